//! What the process does with memory between runs.

use std::{sync::Arc, time::Duration};

use crate::service::Service;

/// Memory is given back once nothing has taken any for about this long.
const IDLE: Duration = Duration::from_secs(10);
/// While there is always something that takes memory, it is given back after so many times [`IDLE`]: a
/// minute. The next run of a million points is a tenth slower then, one of some hundred.
const BUSY: u32 = 6;

/// Sets up the allocator to keep the memory of ended runs for the next ones. Must be called before there
/// are other threads. Without effect where the allocator is not glibc's.
///
/// A run on a million points takes some 60 MB in blocks that the allocator hands back to the system at
/// once, and takes anew at the next run: 15 000 page faults, measured as a tenth of such a request's
/// time. What is kept is given back by [`give_back`].
///
/// Each heap keeps the most it has held, and there may be eight a processor. No more threads than
/// processors are at work at a time, so two heaps a processor do: after ten minutes of mixed load the
/// process had 60 MB so, and 80 MB with eight.
pub fn keep() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        /// Longer blocks are taken from the system one by one; glibc allows no more.
        const LONGEST_KEPT: libc::c_int = 32 << 20;
        let processors = std::thread::available_parallelism().map_or(1, usize::from);
        let heaps = libc::c_int::try_from(2 * processors).unwrap_or(libc::c_int::MAX);
        glibc::set(libc::M_MMAP_THRESHOLD, LONGEST_KEPT);
        glibc::set(libc::M_ARENA_MAX, heaps);
        glibc::keep_ends();
    }
}

/// Gives the memory that [`keep`] kept back to the system: whenever `service` has had nothing to do for a
/// while, all but the ends of the threads' heaps, which glibc does not look at then; and once a minute
/// while it has, with those ends, so that what the worst moment took does not stay for ever.
pub async fn give_back(service: Arc<Service>) {
    let mut time = tokio::time::interval(IDLE);
    let (mut seen, mut busy) = (service.activity(), 0);
    loop {
        time.tick().await;
        let activity = service.activity();
        if activity != seen {
            (seen, busy) = (activity, busy + 1);
            if busy >= BUSY {
                // there is something to give back at the next rest, too
                busy = 1;
                give_back_ends().await;
                give_back_holes().await;
            }
        } else if busy > 0 && service.bytes_in_flight() == 0 {
            busy = 0;
            give_back_holes().await;
        }
    }
}

/// Lets every heap that frees a block meanwhile give back its end.
async fn give_back_ends() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        /// Long enough for every heap in use to free something.
        const MEANWHILE: Duration = Duration::from_secs(2);
        glibc::give_back_ends();
        tokio::time::sleep(MEANWHILE).await;
        glibc::keep_ends();
    }
}

/// Gives back the free pages between blocks.
async fn give_back_holes() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        // it takes milliseconds
        let _ = tokio::task::spawn_blocking(glibc::give_back_holes).await;
    }
}

/// The allocator's C interface.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
mod glibc {
    /// Free bytes at the end of a heap that are kept: a heap has 64 MiB at most.
    const KEPT: libc::c_int = 256 << 20;
    /// Those that are kept while ends are given back: what small runs free and take all the time.
    const LEFT: libc::c_int = 1 << 20;

    /// Sets one of the allocator's numbers.
    #[expect(unsafe_code, reason = "glibc's allocator is set up through its C interface alone")]
    pub fn set(what: libc::c_int, number: libc::c_int) {
        // SAFETY: it takes the allocator's lock and stores a number, which is read on its own
        unsafe {
            libc::mallopt(what, number);
        }
    }

    pub fn keep_ends() {
        set(libc::M_TRIM_THRESHOLD, KEPT);
    }

    pub fn give_back_ends() {
        set(libc::M_TRIM_THRESHOLD, LEFT);
    }

    #[expect(unsafe_code, reason = "glibc's allocator is told so through its C interface alone")]
    pub fn give_back_holes() {
        // SAFETY: it takes the allocator's own locks and touches free memory only
        unsafe {
            libc::malloc_trim(0);
        }
    }
}
