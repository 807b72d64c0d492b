//! What the process does with memory between runs.

use std::{sync::Arc, time::Duration};

use crate::service::Service;

/// Memory is given back once nothing has taken any for about this long.
const IDLE: Duration = Duration::from_secs(10);

/// Keeps the memory of ended runs for the next ones.
///
/// A run on a million points takes some 60 MB in blocks that the allocator hands back to the system at
/// once, and takes anew at the next run: 15 000 page faults, measured as a tenth of such a request's
/// time. Most of it is given back by [`give_back_when_idle`]. Without effect where the allocator is not
/// glibc's.
pub fn keep() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        /// Longer blocks are taken from the system one by one; glibc allows no more.
        const LONGEST_KEPT: libc::c_int = 32 << 20;
        /// Free bytes at the end of a heap that are kept.
        const KEPT: libc::c_int = 256 << 20;
        #[expect(unsafe_code, reason = "glibc's allocator is set up through its C interface alone")]
        // SAFETY: both only store a number; no other thread runs yet
        unsafe {
            libc::mallopt(libc::M_MMAP_THRESHOLD, LONGEST_KEPT);
            libc::mallopt(libc::M_TRIM_THRESHOLD, KEPT);
        }
    }
}

/// Gives the memory that [`keep`] kept back to the system whenever `service` has had nothing to do for a
/// while; all but the ends of the threads' heaps, which glibc does not look at.
pub async fn give_back_when_idle(service: Arc<Service>) {
    let mut time = tokio::time::interval(IDLE);
    let (mut seen, mut kept) = (service.activity(), false);
    loop {
        time.tick().await;
        let activity = service.activity();
        if activity != seen {
            (seen, kept) = (activity, true);
        } else if kept && service.bytes_in_flight() == 0 {
            kept = false;
            // it takes milliseconds
            let _ = tokio::task::spawn_blocking(give_back).await;
        }
    }
}

fn give_back() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    #[expect(unsafe_code, reason = "glibc's allocator is told so through its C interface alone")]
    // SAFETY: it takes the allocator's own locks and touches free memory only
    unsafe {
        libc::malloc_trim(0);
    }
}
