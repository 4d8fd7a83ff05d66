//! `mackrl certify`: whether a trained team runs decentralised.

use serde::Serialize;
use serde_json::Value;

use crate::{args::CertifyArgs, failure::Failure, output, run_folder::Run};

/// Prints what `compare` finds about the trained team in so many episodes, and fails if an action differs.
pub(crate) fn run<C: Serialize>(
    args: &CertifyArgs,
    compare: impl FnOnce(&Run, usize) -> anyhow::Result<C>,
) -> anyhow::Result<()> {
    let certificate = compare(&Run::open(&args.run)?, args.episodes.get())?;
    print(&certificate, args.json)
}

/// Prints a certificate, a JSON object with `mismatches` and what else was counted, and fails if there are any.
fn print(certificate: &impl Serialize, json: bool) -> anyhow::Result<()> {
    let value = serde_json::to_value(certificate)?;
    if json {
        output::print_json(certificate)?;
    } else {
        output::print(&table(&value))?;
    }
    verdict(&value)
}

fn verdict(certificate: &Value) -> anyhow::Result<()> {
    match certificate.get("mismatches").and_then(Value::as_u64) {
        Some(0) => Ok(()),
        Some(mismatches) => Err(Failure::CertificateFailed { mismatches }.into()),
        None => anyhow::bail!("a certificate without `mismatches`"),
    }
}

fn table(certificate: &Value) -> String {
    let rows: Vec<Vec<String>> = certificate
        .as_object()
        .into_iter()
        .flatten()
        .filter(|(_, value)| !value.is_null())
        .map(|(name, value)| vec![name.clone(), value.to_string()])
        .collect();
    output::table(&rows)
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn only_a_certificate_without_mismatches_passes() {
        assert!(verdict(&json!({ "mismatches": 0 })).is_ok());
        let failure = verdict(&json!({ "mismatches": 2 })).unwrap_err();
        assert_eq!(
            failure.to_string(),
            "not decentralised: 2 actions differ from the central run"
        );
        assert!(verdict(&json!({})).is_err());
    }

    #[test]
    fn what_was_not_found_is_not_listed() {
        let certificate = json!({ "episodes": 100, "first_mismatch": null, "mismatches": 0 });
        insta::assert_snapshot!(table(&certificate), @r"
        episodes    100
        mismatches    0
        ");
    }
}
