//! Errors of the libraries as exceptions.

use mackrl_env::IllegalAction as Illegal;
use mackrl_run::{RunError, config::ConfigError, replay::ReplayError};
use pyo3::{
    exceptions::{PyKeyboardInterrupt, PyOSError, PyRuntimeError, PyValueError},
    prelude::*,
    sync::PyOnceLock,
    types::PyType,
};

/// `mackrl.errors`, which defines the exceptions in Python.
fn class<'py>(py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyType>> {
    static MODULE: PyOnceLock<Py<PyModule>> = PyOnceLock::new();
    let module = MODULE.get_or_try_init(py, || {
        PyModule::import(py, "mackrl.errors").map(Bound::unbind)
    })?;
    Ok(module.bind(py).getattr(name)?.cast_into()?)
}

fn new(name: &str, arguments: impl pyo3::PyErrArguments + 'static) -> PyErr {
    Python::attach(|py| match class(py, name) {
        Ok(class) => PyErr::from_type(class, arguments),
        Err(error) => error,
    })
}

/// `mackrl.IllegalAction`: which agent of which world chose what.
pub(crate) fn illegal_action(world: usize, Illegal { agent, action }: Illegal) -> PyErr {
    new("IllegalAction", (world, agent.index(), action.index()))
}

/// `mackrl.WorldFailed`: a world that is not computed, or is the user's own, could not go on.
pub(crate) fn world_failed(message: String) -> PyErr {
    new("WorldFailed", (message,))
}

/// What is wrong with a configuration, a `ValueError`.
pub(crate) fn configuration(error: &ConfigError) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// What went wrong while learning or playing.
pub(crate) fn learning(error: mackrl::Error) -> PyErr {
    RunError::from(error).into_exception()
}

/// What is wrong with a replay.
pub(crate) fn replay(error: &ReplayError) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// Becomes an exception.
pub(crate) trait IntoException {
    /// The exception.
    fn into_exception(self) -> PyErr;
}

impl IntoException for RunError {
    fn into_exception(self) -> PyErr {
        let message = self.chain();
        match self {
            Self::Interrupted { .. } => PyKeyboardInterrupt::new_err(message),
            Self::FolderInUse { .. } | Self::UnfinishedRun { .. } => {
                pyo3::exceptions::PyFileExistsError::new_err(message)
            }
            Self::NotARun { .. } => pyo3::exceptions::PyFileNotFoundError::new_err(message),
            Self::System { .. } | Self::FolderLocked { .. } => PyOSError::new_err(message),
            Self::UpdateRefused { .. } => PyRuntimeError::new_err(message),
            Self::Learning(mackrl::Error::Step(_)) => world_failed(message),
            _ => PyValueError::new_err(message),
        }
    }
}
