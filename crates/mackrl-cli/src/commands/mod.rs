//! What each command does.

pub(crate) mod bench;
pub(crate) mod certify;
pub(crate) mod config;
pub(crate) mod evaluate;
pub(crate) mod execute_agent;
pub(crate) mod explain;
pub(crate) mod maps;
pub(crate) mod play;
pub(crate) mod replay;
pub(crate) mod reproduce;
pub(crate) mod resume;
pub(crate) mod sc2;
pub(crate) mod train;
