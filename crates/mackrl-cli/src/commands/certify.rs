//! `mackrl certify`: whether a trained team runs decentralised.

use std::{
    io::{BufRead, BufReader, Write},
    path::Path,
    process::{Child, ChildStdin, ChildStdout, Command, Stdio},
};

use anyhow::Context;
use mackrl::decentralised::{AgentLink, Answer, Certificate, Request, Subject};
use mackrl_run::{
    provenance::{Choice, Judgement, Provenance},
    run_folder::Run,
    training::assembly,
};
use serde_json::Value;

use crate::{
    args::CertifyArgs,
    commands::sc2,
    failure::Failure,
    output::{self, Sourced},
    progress::Meter,
};

/// Compares a trained team's central run with its agents in processes of their own, and fails if anything differs.
pub(crate) fn run(args: &CertifyArgs) -> anyhow::Result<()> {
    let run = Run::open(&args.run)?;
    let certificate = certify(&args.run, &run, args)
        .with_context(|| format!("cannot certify {}", args.run.display()))?;
    let judgement = Judgement {
        actions: Choice::SampledAndGreedy,
        episodes: args.episodes.get(),
    };
    let seed = args.seed.unwrap_or(run.config.run.seed);
    let provenance = Provenance::of_weights(&run.config, &run.weights, seed, judgement);
    print(provenance, &certificate, args.json)
}

fn certify(folder: &Path, run: &Run, args: &CertifyArgs) -> anyhow::Result<Certificate> {
    let world = sc2::world(&run.config)?;
    let algorithm = assembly::trained(&run.config, &world, &run.weights)?;
    let mut links = (0..world.spec().agents)
        .map(|agent| {
            Ok(
                Box::new(AgentProcess::start(folder, &run.weights_path, agent)?)
                    as Box<dyn AgentLink>,
            )
        })
        .collect::<anyhow::Result<Vec<_>>>()?;
    let mut environment = world.environments(1).remove(0);
    let mut subject = Subject {
        policy: algorithm.policy(),
        parameters: algorithm.parameters(),
        environment: &mut *environment,
        links: &mut links,
        seed: args.seed.unwrap_or(run.config.run.seed),
        sampled: algorithm.behaviour(u64::MAX),
    };
    let meter = Meter::new("episodes");
    Ok(subject.certify(args.episodes.get(), |done, total| meter.report(done, total))?)
}

/// An agent in a process of its own. All that reaches it are the requests written to its stdin.
struct AgentProcess {
    child: Child,
    requests: Option<ChildStdin>,
    answers: BufReader<ChildStdout>,
}

impl AgentProcess {
    fn start(folder: &Path, weights: &Path, agent: usize) -> anyhow::Result<Self> {
        let program = super::this_program()?;
        let mut child = Command::new(program)
            .arg("execute-agent")
            .arg(folder)
            .args(["--agent", &agent.to_string()])
            // A run that goes on has other weights by the time that the last process starts.
            .arg("--weights")
            .arg(weights)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .with_context(|| format!("cannot start a process for agent {agent}"))?;
        let requests = child.stdin.take();
        let answers = child
            .stdout
            .take()
            .context("an agent's process has no stdout")?;
        Ok(Self {
            child,
            requests,
            answers: BufReader::new(answers),
        })
    }

    fn exchange(&mut self, request: &Request) -> anyhow::Result<Option<Answer>> {
        let requests = self.requests.as_mut().context("the process has ended")?;
        let line = serde_json::to_string(request)? + "\n";
        requests
            .write_all(line.as_bytes())
            .and_then(|()| requests.flush())?;
        if matches!(request, Request::Begin { .. }) {
            return Ok(None);
        }
        let mut answer = String::new();
        self.answers.read_line(&mut answer)?;
        Ok(Some(
            serde_json::from_str(&answer).context("the answer is no answer")?,
        ))
    }
}

impl AgentLink for AgentProcess {
    fn ask(&mut self, request: Request) -> Result<Option<Answer>, mackrl::Error> {
        self.exchange(&request)
            .map_err(|error| mackrl::Error::Data(format!("an agent's process failed: {error:#}")))
    }
}

/// The process ends when it has nothing more to read.
impl Drop for AgentProcess {
    fn drop(&mut self) {
        drop(self.requests.take());
        // Whether it ended well does not matter any more; what it answered was compared.
        let _ = self.child.wait();
    }
}

/// Prints a certificate, a JSON object with its provenance, `mismatches` and what else was counted, and fails if there are any.
fn print(provenance: Provenance, certificate: &Certificate, json: bool) -> anyhow::Result<()> {
    let value = serde_json::to_value(certificate)?;
    if json {
        output::print_json(&Sourced {
            provenance,
            result: certificate,
        })?;
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
