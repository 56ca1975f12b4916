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
    watcher: Option<Watcher>,
}

/// Told how many queries are done; says whether the work goes on.
struct Watcher(Box<dyn Fn(usize) -> bool + Send + Sync>);

impl std::fmt::Debug for Watcher {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str("Watcher")
    }
}

impl Monitor {
    /// A monitor that calls a function with the number of queries that are done, after each part of the work, on the
    /// thread that has done it. The work stops where the function returns `false`. For callers without a second
    /// thread, as in WebAssembly; others look at [`Self::done`] from time to time.
    ///
    /// ```
    /// use surfsig::{extract_monitored, Error, ExtractOptions, Monitor, PointCloud, Queries, Radius};
    /// let monitor = Monitor::watched_by(|_| false);
    /// let cloud = PointCloud::new(&[[0.0; 3]; 8]);
    /// let found = extract_monitored(&cloud, Radius::new(1.0)?, &Queries::All, &ExtractOptions::default(), &monitor);
    /// assert_eq!(found.unwrap_err(), Error::Cancelled);
    /// # Ok::<(), Error>(())
    /// ```
    pub fn watched_by(watcher: impl Fn(usize) -> bool + Send + Sync + 'static) -> Self {
        Self { watcher: Some(Watcher(Box::new(watcher))), ..Self::default() }
    }

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
        Self { done: AtomicUsize::new(0), cancelled: Arc::clone(&self.cancelled), watcher: None }
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
        let done = self.done.fetch_add(queries, Relaxed) + queries;
        if self.watcher.as_ref().is_some_and(|watcher| !(watcher.0)(done)) {
            self.cancel();
        }
    }
}
