//! You will see how often scripted teams win on four maps: doing nothing never wins, shooting together wins more than shooting apart.
#![expect(clippy::print_stdout, reason = "an example shows what it found")]

use mackrl_env::{Action, Environment, EpisodeKey, Observations, Stream};
use mackrl_skirmish::{
    MakeError, Skirmish, SkirmishSettings,
    scripted::{ScriptedPolicy, ScriptedTeam},
};

fn main() -> Result<(), MakeError> {
    let episodes = 50;
    println!(
        "{:>14} {:>12} {:>6} {:>7} {:>7}",
        "map", "policy", "wins", "return", "length"
    );
    for name in ["3m", "8m", "5m_vs_6m", "2s3z"] {
        let mut environment = mackrl_skirmish::make(name, &SkirmishSettings::default())?;
        for policy in ScriptedPolicy::ALL {
            let [wins, total, steps] = play(&mut environment, policy, episodes);
            let policy = format!("{policy:?}");
            println!("{name:>14} {policy:>12} {wins:6.2} {total:7.2} {steps:7.1}");
        }
    }
    Ok(())
}

/// Mean wins, return and length.
fn play(environment: &mut Skirmish, policy: ScriptedPolicy, episodes: u64) -> [f64; 3] {
    let spec = environment.spec().clone();
    let mut team = ScriptedTeam::new(policy, environment);
    let mut observations = Observations::new(&spec, 1);
    let mut actions = vec![Action::default(); spec.agents];
    let mut sums = [0.0; 3];
    for episode in 0..episodes {
        let key = EpisodeKey::new(1, Stream::Other, episode);
        environment.reset(key, &mut observations.row_mut(0));
        for step in 0.. {
            team.act(&observations, 0, (key, step), &mut actions);
            let time_step = environment
                .step(&actions, &mut observations.row_mut(0))
                .expect("scripted policies choose available actions");
            sums[1] += f64::from(time_step.reward);
            sums[2] += 1.0;
            if time_step.end.is_some() {
                break;
            }
        }
        sums[0] += f64::from(u8::from(environment.battle_statistics().battle_won));
    }
    sums.map(|sum| sum / episodes as f64)
}
