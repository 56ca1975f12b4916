//! Where models come from: memory, or a library that loads each when it is needed.

use super::Model;
use crate::Error;
use std::borrow::Cow;

/// Models that are loaded when they are needed, so that a library may be larger than memory.
///
/// ```
/// use std::borrow::Cow;
/// use surfsig::{Error, FindSettings, Model, ModelSource, Monitor, PointCloud, Scan, find_instances_of};
///
/// /// A library without models.
/// struct Empty;
///
/// impl ModelSource for Empty {
///     fn count(&self) -> usize {
///         0
///     }
///     fn radius(&self, _: usize) -> f64 {
///         f64::INFINITY
///     }
///     fn brief(&self, _: usize) -> Result<Cow<'_, Model>, Error> {
///         unreachable!()
///     }
///     fn whole(&self, _: usize) -> Result<Cow<'_, Model>, Error> {
///         unreachable!()
///     }
/// }
///
/// let scene = Scan::new(PointCloud::new(&[[0.0; 3]; 80]));
/// let found = find_instances_of(&Empty, &scene, &FindSettings::default(), &Monitor::default())?;
/// assert!(found.is_empty());
/// # Ok::<(), Error>(())
/// ```
pub trait ModelSource: Sync {
    /// How many models there are.
    fn count(&self) -> usize;

    /// Radius of the smallest patches of a model.
    fn radius(&self, number: usize) -> f64;

    /// What [`Model::brief`] gives of a model.
    ///
    /// # Errors
    /// Whatever keeps it from being loaded.
    fn brief(&self, number: usize) -> Result<Cow<'_, Model>, Error>;

    /// A model.
    ///
    /// # Errors
    /// Whatever keeps it from being loaded.
    fn whole(&self, number: usize) -> Result<Cow<'_, Model>, Error>;
}

/// Models in memory.
pub(super) struct InMemory<'a>(pub &'a [&'a Model]);

impl ModelSource for InMemory<'_> {
    fn count(&self) -> usize {
        self.0.len()
    }

    fn radius(&self, number: usize) -> f64 {
        self.0[number].places.radius
    }

    fn brief(&self, number: usize) -> Result<Cow<'_, Model>, Error> {
        Ok(Cow::Owned(self.0[number].brief()))
    }

    fn whole(&self, number: usize) -> Result<Cow<'_, Model>, Error> {
        Ok(Cow::Borrowed(self.0[number]))
    }
}
