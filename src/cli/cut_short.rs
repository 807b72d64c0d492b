//! What is told where a mapped file becomes shorter, or its disk fails, while it is read.

use std::path::Path;

/// Ends the process with a message, and the status of other errors, where a page of `map` is not there any more. Without
/// that, the system would end it without a word.
#[cfg(unix)]
pub fn watch(map: &[u8], path: &Path) {
    signal::watch(map, path);
}

#[cfg(not(unix))]
pub fn watch(_: &[u8], _: &Path) {}

#[cfg(unix)]
mod signal {
    use std::{
        path::Path,
        sync::{
            OnceLock,
            atomic::{AtomicUsize, Ordering},
        },
    };

    static MESSAGE: OnceLock<Vec<u8>> = OnceLock::new();
    static BEGIN: AtomicUsize = AtomicUsize::new(0);
    static END: AtomicUsize = AtomicUsize::new(0);

    /// The process maps one file; the first one is told of.
    pub fn watch(map: &[u8], path: &Path) {
        let path = path.display();
        let message = format!(
            "conicoid: {path} cannot be read to its end: it was cut short while it was read, or its disk fails\n"
        );
        if MESSAGE.set(message.into_bytes()).is_err() {
            return;
        }
        let begin = map.as_ptr().addr();
        BEGIN.store(begin, Ordering::Relaxed);
        END.store(begin + map.len(), Ordering::Relaxed);
        install();
    }

    #[expect(unsafe_code, reason = "a handler of a signal is set through C's interface alone")]
    fn install() {
        // SAFETY: all fields of the struct may be zero; the handler has the signature that SA_SIGINFO asks for, and calls
        // nothing but what a handler may
        unsafe {
            let mut action: libc::sigaction = std::mem::zeroed();
            action.sa_sigaction = handle as *const () as usize;
            action.sa_flags = libc::SA_SIGINFO | libc::SA_ONSTACK;
            libc::sigaction(libc::SIGBUS, &raw const action, std::ptr::null_mut());
        }
    }

    #[expect(unsafe_code, reason = "what the system tells of a signal is a C struct")]
    extern "C" fn handle(_: libc::c_int, info: *mut libc::siginfo_t, _: *mut libc::c_void) {
        // SAFETY: the system gives the struct of this signal, whose address is set; write, signal and _exit are among what a
        // handler may call
        unsafe {
            let at = (*info).si_addr().addr();
            // the last page is as long as the others
            let end = END.load(Ordering::Relaxed).next_multiple_of(1 << 16);
            if (BEGIN.load(Ordering::Relaxed)..end).contains(&at)
                && let Some(message) = MESSAGE.get()
            {
                libc::write(libc::STDERR_FILENO, message.as_ptr().cast(), message.len());
                libc::_exit(1);
            }
            // another cause: the instruction is tried again, and ends the process as it would have
            libc::signal(libc::SIGBUS, libc::SIG_DFL);
        }
    }
}
