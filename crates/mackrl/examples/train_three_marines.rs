//! You will see a team of three marines learn to beat three others, within a minute or so of games and seconds of yours.
#![expect(clippy::print_stdout, reason = "an example shows what it found")]

use mackrl_run::{config::Config, training::Trainer};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let config = Config::with(&[
        "env.map=3m",
        "algorithm.name=mackrl",
        "run.steps_env=25000",
        "run.metrics_interval_steps_env=1000000",
        "test.interval_steps_env=5000",
    ])?;
    let mut trainer = Trainer::new(&config, 2)?;
    println!(" steps   won   return   enemies defeated   pairs that know something and delegate");
    while !trainer.finished() {
        if let Some(row) = trainer.update()? {
            let number = |name: &str| row.get(name).unwrap_or(f64::NAN);
            println!(
                "{:6} {:4.0} % {:7.2} {:18.2} {:40.0} %",
                number("t_env"),
                100.0 * number("test_battle_won_mean"),
                number("test_return_mean"),
                number("test_dead_enemies_mean"),
                100.0 * number("test_mackrl/delegation_rate"),
            );
        }
    }
    Ok(())
}
