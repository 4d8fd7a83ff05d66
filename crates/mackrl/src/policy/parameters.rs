//! Parameters with the form in which they are computed with.

use std::{
    any::Any,
    fmt,
    sync::{
        OnceLock,
        atomic::{AtomicU64, Ordering},
    },
};

/// Counts versions: each change of any parameters gets a number of its own.
static VERSIONS: AtomicU64 = AtomicU64::new(1);

/// The parameters of a policy as one flat vector.
///
/// They know their version, so that what was computed with them can be told from what was computed with others, and they
/// keep the form in which kernels read them (packed weights), which is made by the first that needs it and then shared.
pub struct Parameters {
    values: Vec<f32>,
    version: u64,
    prepared: OnceLock<Box<dyn Any + Send + Sync>>,
}

impl Parameters {
    /// These values, as a version of their own.
    #[must_use]
    pub fn new(values: Vec<f32>) -> Self {
        Self {
            values,
            version: VERSIONS.fetch_add(1, Ordering::Relaxed),
            prepared: OnceLock::new(),
        }
    }

    /// The values.
    #[must_use]
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// A number that no other values have had since the program began. No result depends on it.
    #[must_use]
    pub const fn version(&self) -> u64 {
        self.version
    }

    /// Changes the values, which become another version, and gives what `change` gives.
    pub fn change<T>(&mut self, change: impl FnOnce(&mut Vec<f32>) -> T) -> T {
        let result = change(&mut self.values);
        self.version = VERSIONS.fetch_add(1, Ordering::Relaxed);
        self.prepared = OnceLock::new();
        result
    }

    /// The values in the form that `prepare` makes of them, once for each version.
    ///
    /// # Panics
    /// If two kinds of policy prepare the same parameters.
    pub fn prepared<T: Any + Send + Sync>(&self, prepare: impl FnOnce(&[f32]) -> T) -> &T {
        let prepared = self
            .prepared
            .get_or_init(|| Box::new(prepare(&self.values)));
        prepared
            .downcast_ref()
            .expect("parameters belong to one kind of policy")
    }
}

impl Clone for Parameters {
    fn clone(&self) -> Self {
        Self::new(self.values.clone())
    }
}

impl fmt::Debug for Parameters {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("Parameters")
            .field("count", &self.values.len())
            .field("version", &self.version)
            .finish_non_exhaustive()
    }
}
