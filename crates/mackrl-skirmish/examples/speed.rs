//! You will see how many steps a second each map plays on one core.
#![expect(clippy::print_stdout, reason = "an example shows what it found")]

use std::{
    error::Error,
    time::{Duration, Instant},
};

use mackrl_env::random_play::RandomPlay;
use mackrl_skirmish::SkirmishSettings;

const PATIENCE: Duration = Duration::from_millis(300);

fn main() -> Result<(), Box<dyn Error>> {
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    for name in mackrl_skirmish::map_names() {
        if !wanted.is_empty() && !wanted.iter().any(|wanted| wanted == name) {
            continue;
        }
        let environment = mackrl_skirmish::make(name, &SkirmishSettings::default())?;
        let mut play = RandomPlay::new(Box::new(environment), 1);
        let (start, mut steps) = (Instant::now(), 0);
        while start.elapsed() < PATIENCE {
            play.step()?;
            steps += 1;
        }
        let per_second = f64::from(steps) / start.elapsed().as_secs_f64();
        println!("{name:>18} {per_second:>9.0} steps/s");
    }
    Ok(())
}
