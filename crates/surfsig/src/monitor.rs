//! How a caller watches an extraction, and stops it.

use crate::Error;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering::Relaxed};

/// Shared with a running extraction: how far it is, and whether it should stop.
///
/// ```
/// use surfsig::{extract_monitored, Error, ExtractOptions, Monitor, PointCloud, Queries, Radius};
/// let monitor = Monitor::default();
/// monitor.cancel();
/// let cloud = PointCloud::new(&[[0.0; 3]]);
/// let stopped = extract_monitored(&cloud, Radius::new(1.0)?, &Queries::All, &ExtractOptions::default(), &monitor);
/// assert_eq!(stopped.unwrap_err(), Error::Cancelled);
/// # Ok::<(), Error>(())
/// ```
#[derive(Debug, Default)]
pub struct Monitor {
    done: AtomicUsize,
    cancelled: Arc<AtomicBool>,
}

impl Monitor {
    /// Queries that are done.
    pub fn done(&self) -> usize {
        self.done.load(Relaxed)
    }

    /// Asks the extraction to stop; it returns [`crate::Error::Cancelled`] soon after.
    pub fn cancel(&self) {
        self.cancelled.store(true, Relaxed);
    }

    /// One for work that is stopped with this, and counted apart.
    pub(crate) fn apart(&self) -> Self {
        Self { done: AtomicUsize::new(0), cancelled: Arc::clone(&self.cancelled) }
    }

    /// An error where the caller asked to stop.
    pub(crate) fn check(&self) -> Result<(), Error> {
        if self.cancelled.load(Relaxed) { Err(Error::Cancelled) } else { Ok(()) }
    }

    /// Some queries must be done again.
    pub(crate) fn take_back(&self, queries: usize) {
        self.done.fetch_sub(queries, Relaxed);
    }

    pub(crate) fn add(&self, queries: usize) {
        self.done.fetch_add(queries, Relaxed);
    }
}
