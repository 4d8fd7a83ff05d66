//! You will see how many steps a second each map plays on one core.
#![expect(clippy::print_stdout, reason = "an example shows what it found")]

use std::time::Duration;

use mackrl_env::{
    registry::{self, MakeError},
    skirmish::{SkirmishSettings, measure_speed},
};

fn main() -> Result<(), MakeError> {
    let names: Vec<String> = std::env::args().skip(1).collect();
    for name in registry::names() {
        if !names.is_empty() && !names.iter().any(|wanted| wanted == name) {
            continue;
        }
        let mut environment = registry::make(name, &SkirmishSettings::default())?;
        let speed = measure_speed(environment.as_mut(), Duration::from_millis(1000));
        println!("{name:>18} {:>9.0} steps/s", speed.steps_per_second());
    }
    Ok(())
}
