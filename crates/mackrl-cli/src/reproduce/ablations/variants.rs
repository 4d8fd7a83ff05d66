//! What is taken away from MACKRL, or put in its place, one thing at a time.

use mackrl_run::config::Config;

/// A learner of the ablation study.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Variant {
    /// In names of files.
    pub(super) name: &'static str,
    /// In the legend.
    pub(super) label: &'static str,
    /// What is laid over the preset.
    pub(super) settings: &'static [&'static str],
    /// What the comparison with MACKRL tells.
    pub(super) question: &'static str,
}

/// MACKRL itself, which all others are compared with.
pub(super) const MACKRL: Variant = Variant {
    name: "mackrl",
    label: "MACKRL",
    settings: &[],
    question: "what everything is compared with",
};

const OTHERS: [Variant; 7] = [
    Variant {
        name: "central-v",
        label: "Central-V",
        settings: &["algorithm.name=central-v"],
        question: "what the hierarchy adds to independent agents with a central critic",
    },
    Variant {
        name: "always-delegate",
        label: "always delegate",
        settings: &["algorithm.delegation=always"],
        question: "whether the gain comes from acting jointly: without it, this is Central-V",
    },
    Variant {
        name: "never-delegate",
        label: "never delegate",
        settings: &["algorithm.delegation=never"],
        question: "whether pairs have to learn when not to act jointly",
    },
    Variant {
        name: "one-partition",
        label: "one partition",
        settings: &["algorithm.partitions=sampled:1"],
        question: "whether it matters who acts with whom",
    },
    Variant {
        name: "five-partitions",
        label: "5 partitions",
        settings: &["algorithm.partitions=sampled:5"],
        question: "how many partitions are needed",
    },
    Variant {
        name: "uniform-selector",
        label: "uniform selector",
        settings: &["algorithm.selector=uniform"],
        question: "whether the choice of the partition has to be learned",
    },
    Variant {
        name: "state-only-critic",
        label: "critic without last actions",
        settings: &["env.state_last_action=false"],
        question: "whether the critic has to know what was done last",
    },
];

const THIN: Variant = Variant {
    name: "thin-features",
    label: "thin features",
    settings: &["algorithm.common_knowledge=thin"],
    question: "what health, shield and unit type in the common knowledge are worth",
};
const COMPLETE: Variant = Variant {
    name: "complete-features",
    label: "complete features",
    settings: &["algorithm.common_knowledge=complete"],
    question: "what health, shield and unit type in the common knowledge are worth",
};

/// All learners for a preset: MACKRL first, and the kind of features that the preset does not have last.
pub(super) fn variants(preset: &Config) -> Vec<Variant> {
    let features = match preset.algorithm.text("common_knowledge") {
        "thin" => COMPLETE,
        _ => THIN,
    };
    [&[MACKRL], &OTHERS[..], &[features]].concat()
}

#[cfg(test)]
mod tests {
    use mackrl_run::{config::ConfigBuilder, recorded::setting};

    use super::*;

    #[test]
    fn every_variant_differs_from_the_preset_in_what_it_says_and_in_nothing_else() {
        let mut presets = 0;
        for preset in crate::registry().presets() {
            // A map on which no variant is impossible, as the figure's.
            let base = ConfigBuilder::new(crate::registry())
                .preset(preset.name)
                .unwrap();
            let base = base.set("env.map=2s3z").unwrap();
            let config = base.build().unwrap();
            // What is varied is the hierarchy of pairs.
            if setting(&config, "algorithm.levels") != "pairs" {
                continue;
            }
            presets += 1;
            for variant in variants(&config).into_iter().skip(1) {
                let changed = (variant.settings.iter())
                    .try_fold(base.clone(), |builder, setting| builder.set(setting))
                    .unwrap();
                let changed = changed.build().unwrap();
                // Central-V has no settings of the hierarchy.
                let differing = changed.keys();
                let differing = differing.filter(|key| changed.get(key) != config.get(key));
                assert_eq!(differing.count(), 1, "{} of {}", variant.name, preset.name);
            }
        }
        assert!(presets >= 3, "default, paper and paper-code");
    }
}
