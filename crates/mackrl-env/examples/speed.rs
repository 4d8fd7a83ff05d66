//! You will see how many steps a second each map plays on one core.
#![expect(clippy::print_stdout, reason = "an example shows what it found")]

use std::time::Duration;

use mackrl_env::{
    registry::{self, MakeError},
    skirmish::{SkirmishSettings, measure_speed},
};

fn main() -> Result<(), MakeError> {
    for name in registry::names() {
        let mut environment = registry::make(name, &SkirmishSettings::default())?;
        let speed = measure_speed(environment.as_mut(), Duration::from_millis(500));
        println!("{name:>18} {:>9.0} steps/s", speed.steps_per_second());
    }
    Ok(())
}
