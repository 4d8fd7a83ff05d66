//! A certificate as a page of its own, to be filed.

use mackrl_run::provenance::Provenance;
use serde_json::Value;

use super::Stated;
use crate::output::escaped;

const STYLE: &str = "body { max-width: 46rem; margin: 2rem auto; padding: 0 1rem; font: 16px/1.5 system-ui, sans-serif; color: #22262b; background: #fff; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.1rem; margin-top: 2rem; }
.verdict { border-left: 5px solid #009e73; padding: .2rem 1rem; } .failed { border-color: #d55e00; }
table { border-collapse: collapse; width: 100%; } td { border-top: 1px solid #dcd8ce; padding: .25rem .5rem .25rem 0; vertical-align: top; overflow-wrap: anywhere; }
td:last-child { font-variant-numeric: tabular-nums; } @media print { body { margin: 0; } }
";

/// What each count means, in the order of the page.
pub(super) const COUNTS: [(&str, &str); 15] = [
    ("agents", "Agents of the team"),
    (
        "isolation",
        "What keeps the agents apart: system-calls, processes or none",
    ),
    (
        "episodes",
        "Episodes in each of two modes, sampled and greedy",
    ),
    ("steps", "Steps of the world"),
    (
        "actions_compared",
        "Actions of agents on their own, compared with the central run",
    ),
    (
        "inputs_compared",
        "Inputs of controllers, compared bit for bit",
    ),
    (
        "outputs_compared",
        "Rows of log-probabilities, compared bit for bit",
    ),
    (
        "altered_actions_compared",
        "Actions in worlds in which all that the agent does not see is noise",
    ),
    (
        "altered_inputs_compared",
        "Inputs of controllers in such worlds",
    ),
    (
        "altered_outputs_compared",
        "Rows of log-probabilities in such worlds",
    ),
    (
        "unseen_numbers_compared",
        "Steps of agents on their own at which all that they do not see is no number",
    ),
    (
        "altered_states_compared",
        "Observations after the state was altered beyond the agent's sight",
    ),
    (
        "other_key_compared",
        "Inputs and rows of log-probabilities when choices are drawn from another key",
    ),
    ("mismatches", "Comparisons that failed"),
    (
        "mismatches_in_altered_worlds",
        "Those of them in altered worlds",
    ),
];

/// The page.
///
/// # Errors
/// Never: a certificate and its provenance can be written as JSON.
pub(super) fn page(stated: &Stated<'_>, provenance: &Provenance) -> anyhow::Result<String> {
    let certificate = serde_json::to_value(stated.certificate)?;
    let row = |meaning: &str, value: &Value| {
        let value = value
            .as_str()
            .map_or_else(|| value.to_string(), str::to_owned);
        format!(
            "<tr><td>{}</td><td>{}</td></tr>\n",
            escaped(meaning),
            escaped(&value)
        )
    };
    let counts: String = COUNTS
        .iter()
        .map(|(name, meaning)| row(meaning, &certificate[*name]))
        .collect();
    let not_proved: String = (stated.not_proved.iter())
        .map(|sentence| format!("<li>{}</li>\n", escaped(sentence)))
        .collect();
    let origin = serde_json::to_value(provenance)?;
    let origin: String = origin
        .as_object()
        .into_iter()
        .flatten()
        .map(|(name, value)| row(name, value))
        .collect();
    let example = match &stated.certificate.first_mismatch {
        Some(example) => format!(
            "<h2>First difference</h2>\n<pre>{}</pre>\n",
            escaped(&serde_json::to_string_pretty(example)?)
        ),
        None => String::new(),
    };
    let (class, title) = match stated.certificate.mismatches {
        0 => ("verdict", "Runs decentralised"),
        _ => ("verdict failed", "Does not run decentralised"),
    };
    Ok(format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'\">\n\
         <title>Certificate of decentralised execution</title>\n<style>{STYLE}</style>\n</head>\n<body>\n\
         <h1>Certificate of decentralised execution: {title}</h1>\n<p class=\"{class}\">{}</p>\n\
         <h2>Not proved</h2>\n<ul>\n{not_proved}</ul>\n{example}\
         <h2>What was compared</h2>\n<table>\n{counts}</table>\n\
         <h2>Where it comes from</h2>\n<table>\n{origin}</table>\n</body>\n</html>\n",
        escaped(&stated.proved)
    ))
}

#[cfg(test)]
mod tests {
    use mackrl::decentralised::Certificate;
    use mackrl_run::{
        config::Config,
        provenance::{Choice, Judgement},
    };

    use super::*;

    #[test]
    fn a_page_says_what_was_proved_and_what_was_not_and_names_nothing_that_it_does_not_count() {
        let certificate = Certificate {
            mismatches: 3,
            ..Certificate::default()
        };
        let stated = Stated {
            proved: certificate.proved("<3m>"),
            not_proved: certificate.not_proved(),
            certificate: &certificate,
        };
        let judgement = Judgement {
            actions: Choice::SampledAndGreedy,
            episodes: 1,
        };
        let provenance = Provenance::of_weights(&Config::default(), b"", 1, judgement);
        let page = page(&stated, &provenance).unwrap();
        assert!(page.contains("Does not run decentralised") && page.contains("&lt;3m&gt;"));
        assert!(page.contains("Not proved") && page.contains(&provenance.id));
        let counted = serde_json::to_value(&certificate).unwrap();
        for (name, _) in COUNTS {
            assert!(counted.get(name).is_some(), "{name}");
        }
    }
}
