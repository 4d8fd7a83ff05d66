//! You will see a pair learn to earn more than a joint learner can: it acts jointly on common knowledge, and delegates without.
#![expect(clippy::print_stdout, reason = "an example shows what it found")]

use mackrl_run::{config::Config, training::Trainer};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let config = Config::with(&[
        "env.name=matrix-game",
        "algorithm.name=mackrl",
        "env.common_knowledge=0.7",
        "algorithm.environments=32",
        "algorithm.learning_rate=0.001",
        "algorithm.critic_learning_rate=0.005",
        "algorithm.exploration_start=0.9",
        "run.steps_env=40000",
        "run.metrics_interval_steps_env=1000000",
        "test.interval_steps_env=4000",
        "test.episodes=1000",
    ])?;
    println!(
        "In 7 of 10 games the matrix is common knowledge. A joint learner earns at most 0.85;"
    );
    println!("acting jointly or delegating, whichever is better, earns at most 0.925.\n");
    println!(" games   return   delegated although it had common knowledge");
    let mut trainer = Trainer::new(&config, 1)?;
    while !trainer.finished() {
        if let Some(row) = trainer.update()? {
            let number = |name: &str| row.get(name).unwrap_or(f64::NAN);
            println!(
                "{:6} {:8.3} {:41.3}",
                number("t_env"),
                number("test_return_mean"),
                number("test_mackrl/delegation_rate"),
            );
        }
    }
    Ok(())
}
