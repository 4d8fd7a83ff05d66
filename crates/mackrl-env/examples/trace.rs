use mackrl_env::skirmish::{SkirmishSettings, scripted::ScriptedPolicy};
use mackrl_env::*;
fn main() {
    let mut e = registry::make_skirmish("3m", &SkirmishSettings::default()).unwrap();
    let spec = e.spec().clone();
    let prior = e.prior_knowledge();
    let mut o = Observations::new(&spec, 1);
    let key = EpisodeKey::new(1, Stream::Other, 0);
    e.reset(key, &mut o.row_mut(0));
    let mut a = vec![Action::default(); 3];
    for step in 0..40 {
        ScriptedPolicy::Nearest.act(&spec, prior.as_ref(), &o, 0, (key, step), &mut a);
        let ts = e.step(&a, &mut o.row_mut(0)).unwrap();
        print!(
            "{step} {:?} ",
            a.iter().map(|a| a.index()).collect::<Vec<_>>()
        );
        let s = e.battle().state();
        for (i, u) in s.units.iter().enumerate().filter(|_| step > 3) {
            print!(
                "| {:.2},{:.2} hp{} cd{:.1} q{:?} ",
                s.x[i], s.y[i], u.life, u.cooldown, u.quarry
            );
        }
        println!();
        if ts.end.is_some() {
            break;
        }
    }
}
