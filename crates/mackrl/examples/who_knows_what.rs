//! You will see what each pair of a team commonly knows in the middle of a battle, and why it may be nothing.
#![expect(clippy::print_stdout, reason = "an example shows what it found")]

use mackrl::{common_knowledge::common_knowledge, partition::Pairs};
use mackrl_env::{Action, AgentId, EntitySet, Environment, EpisodeKey, Observations, Stream};
use mackrl_skirmish::{
    Skirmish, SkirmishSettings,
    scripted::{ScriptedPolicy, ScriptedTeam},
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut world = mackrl_skirmish::make("2s3z", &SkirmishSettings::default())?;
    let agents = world.spec().agents;
    let observations = after_some_steps(&mut world, 20)?;
    let visible_n = observations.visible(0);
    println!(
        "2s3z after 20 steps of walking about: entities 0 to 4 are the team, 5 to 9 the enemy.\n"
    );
    for (agent, seen) in visible_n.iter().enumerate() {
        println!("agent {agent} sees {}", list(*seen));
    }
    println!();
    for pair in Pairs::new(agents).iter() {
        let [first, second] = pair.agents();
        let known = common_knowledge(&[first, second], visible_n);
        let sees = |observer: AgentId, other: AgentId| visible_n[observer.index()].contains(other);
        let dead = (pair.agents().into_iter()).find(|agent| visible_n[agent.index()].is_empty());
        if let Some(dead) = dead {
            println!("{first} and {second} commonly know nothing: {dead} is dead");
        } else if known.is_empty() {
            let (blind, unseen) = if sees(first, second) {
                (second, first)
            } else {
                (first, second)
            };
            println!("{first} and {second} commonly know nothing: {blind} does not see {unseen}");
        } else {
            println!("{first} and {second} commonly know {}", list(known));
        }
    }
    let team: Vec<AgentId> = (0..agents).map(AgentId::new).collect();
    let known = common_knowledge(&team, visible_n);
    println!("\nthe team as a whole commonly knows {}", list(known));
    Ok(())
}

/// What a team that acts at random observes after `steps` steps.
fn after_some_steps(
    world: &mut Skirmish,
    steps: usize,
) -> Result<Observations, mackrl_env::StepError> {
    let spec = world.spec().clone();
    let mut team = ScriptedTeam::new(ScriptedPolicy::Random, world);
    let mut observations = Observations::new(&spec, 1);
    let mut actions = vec![Action::default(); spec.agents];
    let key = EpisodeKey::new(1, Stream::Other, 0);
    world.reset(key, &mut observations.row_mut(0));
    for step in 0..steps {
        let at = (key, step);
        team.act(&observations, 0, at, &mut actions);
        world.step(&actions, &mut observations.row_mut(0))?;
    }
    Ok(observations)
}

fn list(entities: EntitySet) -> String {
    if entities.is_empty() {
        return "nothing".to_owned();
    }
    let names: Vec<String> = entities.iter().map(|entity| entity.to_string()).collect();
    names.join(" ")
}
