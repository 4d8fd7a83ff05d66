//! `mackrl certify`: whether a trained team runs decentralised.

use std::{
    cell::Cell,
    io::{BufRead, BufReader, Write},
    process::{Child, ChildStdin, ChildStdout, Command, Stdio},
    rc::Rc,
};

use anyhow::Context;
use mackrl::decentralised::{
    AgentLink, Answer, Certificate, Isolation, Repetition, Request, Subject,
};
use mackrl_run::{
    provenance::{Choice, Judgement, Provenance},
    run_folder::Run,
    training::assembly,
};
use serde::Serialize;
use serde_json::Value;

use super::{
    execute_agent::{Introduction, Readiness},
    this_program,
};
use crate::{
    args::CertifyArgs,
    commands::sc2,
    failure::Failure,
    isolation::was_ended_by_it,
    output::{self, Sourced},
    progress::Meter,
};

mod page;

/// What is passed on to the agents' processes of the environment of this one.
const PASSED_ON: [&str; 2] = ["MACKRL_SIMD", "PATH"];

/// A certificate with what it says.
#[derive(Debug, Serialize)]
struct Stated<'a> {
    /// What was proved, the first sentence in short.
    proved: String,
    /// What was not, a sentence each.
    not_proved: Vec<&'static str>,
    #[serde(flatten)]
    certificate: &'a Certificate,
}

/// Compares a trained team's central run with its agents in processes of their own, and fails if anything differs.
pub(crate) fn run(args: &CertifyArgs) -> anyhow::Result<()> {
    let run = Run::open(&args.run, args.weights.checkpoint)?;
    let certificate =
        certify(&run, args).with_context(|| format!("cannot certify {}", args.run.display()))?;
    let judgement = Judgement {
        actions: Choice::SampledAndGreedy,
        episodes: args.episodes.get(),
    };
    let seed = args.seed.unwrap_or(run.config.run.seed);
    let provenance = Provenance::of_weights(&run.config, &run.weights, seed, judgement);
    let stated = Stated {
        proved: certificate.proved(run.config.env.map()),
        not_proved: certificate.not_proved(),
        certificate: &certificate,
    };
    if let Some(file) = &args.html {
        output::write_file(file, page::page(&stated, &provenance)?.as_bytes())?;
    }
    print(provenance, &stated, args.json)
}

fn certify(run: &Run, args: &CertifyArgs) -> anyhow::Result<Certificate> {
    let world = sc2::world(&run.config)?;
    let algorithm = assembly::trained(&run.config, &world, &run.weights)?;
    let reached_out = Rc::new(Cell::new(None));
    let processes = (0..world.spec().agents)
        .map(|agent| AgentProcess::start(run, agent, &reached_out))
        .collect::<anyhow::Result<Vec<_>>>()?;
    let all_isolated = processes
        .iter()
        .all(|process| process.isolation == Isolation::SystemCalls);
    let mut links: Vec<Box<dyn AgentLink>> = processes
        .into_iter()
        .map(|process| Box::new(process) as Box<dyn AgentLink>)
        .collect();
    let mut environment = world.environments(1).remove(0);
    let mut subject = Subject {
        policy: algorithm.policy(),
        parameters: algorithm.parameters(),
        environment: &mut *environment,
        repetition: if run.config.env.is_star_craft() {
            Repetition::Impossible
        } else {
            Repetition::Exact
        },
        links: &mut links,
        isolation: if all_isolated {
            Isolation::SystemCalls
        } else {
            Isolation::Processes
        },
        seed: args.seed.unwrap_or(run.config.run.seed),
        sampled: algorithm.behaviour(u64::MAX),
    };
    let meter = Meter::new("episodes");
    let certificate = subject.certify(args.episodes.get(), |done, total| meter.report(done, total));
    if let Some(agent) = reached_out.get() {
        return Err(Failure::ReachedOut { agent }.into());
    }
    Ok(certificate?)
}

/// An agent in a process of its own. All that reaches it is written to its stdin: who it is, the weights, and the requests.
struct AgentProcess {
    agent: usize,
    child: Child,
    requests: Option<ChildStdin>,
    answers: BufReader<ChildStdout>,
    isolation: Isolation,
    /// Where an agent is noted that the system ended because it tried to reach something else.
    reached_out: Rc<Cell<Option<usize>>>,
}

impl AgentProcess {
    fn start(
        run: &Run,
        agent: usize,
        reached_out: &Rc<Cell<Option<usize>>>,
    ) -> anyhow::Result<Self> {
        let mut command = Command::new(this_program()?);
        command.arg("execute-agent");
        if cfg!(unix) {
            let kept = |name| Some((name, std::env::var_os(name)?));
            command
                .env_clear()
                .envs(PASSED_ON.into_iter().filter_map(kept))
                .current_dir("/");
        }
        let mut child = command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .with_context(|| format!("cannot start a process for agent {agent}"))?;
        let mut requests = child
            .stdin
            .take()
            .context("an agent's process has no stdin")?;
        let answers = child
            .stdout
            .take()
            .context("an agent's process has no stdout")?;
        let introduction = Introduction {
            agent,
            config: run.config.to_toml(),
            weights_bytes: run.weights.len(),
        };
        let line = serde_json::to_string(&introduction)? + "\n";
        let told = requests
            .write_all(line.as_bytes())
            .and_then(|()| requests.write_all(&run.weights))
            .and_then(|()| requests.flush());
        told.with_context(|| format!("cannot tell agent {agent} who it is"))?;
        let mut process = Self {
            agent,
            child,
            requests: Some(requests),
            answers: BufReader::new(answers),
            isolation: Isolation::Processes,
            reached_out: Rc::clone(reached_out),
        };
        process.isolation = process.read::<Readiness>()?.isolation;
        Ok(process)
    }

    /// Reads a line that the agent says.
    fn read<T: serde::de::DeserializeOwned>(&mut self) -> anyhow::Result<T> {
        let mut line = String::new();
        self.answers.read_line(&mut line)?;
        serde_json::from_str(&line).context("the answer is no answer")
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
        self.read().map(Some)
    }

    /// Notes it if the system has ended the process because it tried to reach something else.
    fn note_reaching_out(&mut self) {
        drop(self.requests.take());
        if self.child.wait().is_ok_and(was_ended_by_it) {
            self.reached_out.set(Some(self.agent));
        }
    }
}

impl AgentLink for AgentProcess {
    fn ask(&mut self, request: Request) -> Result<Option<Answer>, mackrl::Error> {
        let agent = self.agent;
        self.exchange(&request).map_err(|error| {
            self.note_reaching_out();
            mackrl::Error::Data(format!("the process of agent {agent} failed: {error:#}"))
        })
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

/// Prints a certificate, a JSON object with its provenance, `proved`, `mismatches` and what else was counted, and fails if there
/// are any.
fn print(provenance: Provenance, stated: &Stated<'_>, json: bool) -> anyhow::Result<()> {
    let value = serde_json::to_value(stated.certificate)?;
    if json {
        output::print_json(&Sourced {
            provenance,
            result: stated,
        })?;
    } else {
        let not_proved: String = (stated.not_proved.iter())
            .map(|sentence| format!("- {sentence}\n"))
            .collect();
        output::print(&format!(
            "{}\n\nNot proved:\n{not_proved}\n{}",
            stated.proved,
            table(&value)
        ))?;
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

/// What was counted, in words.
fn table(certificate: &Value) -> String {
    let count = |(name, meaning): &(&str, &str)| {
        let count = certificate.get(name)?;
        let count = count
            .as_str()
            .map_or_else(|| count.to_string(), str::to_owned);
        Some(vec![(*meaning).to_owned(), count])
    };
    let rows: Vec<Vec<String>> = page::COUNTS.iter().filter_map(count).collect();
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
            "not decentralised: 2 comparisons with the central run failed"
        );
        assert!(verdict(&json!({})).is_err());
    }

    #[test]
    fn what_was_counted_is_told_in_words() {
        let certificate = json!({ "first_mismatch": null, "mismatches": 0, "steps": 150 });
        insta::assert_snapshot!(table(&certificate), @r"
        Steps of the world       150
        Comparisons that failed    0
        ");
    }
}
