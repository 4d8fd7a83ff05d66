//! What each command does.

pub(crate) mod bench;
#[expect(dead_code, reason = "the certificate is wired next")]
pub(crate) mod certify;
pub(crate) mod config;
#[expect(dead_code, reason = "evaluation is wired next")]
pub(crate) mod evaluate;
pub(crate) mod maps;
pub(crate) mod reproduce;
#[expect(dead_code, reason = "training is wired next")]
pub(crate) mod train;
