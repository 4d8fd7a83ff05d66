//! What the learners report, explained.

/// What is reported.
pub(super) const METRICS: &[(&str, &str)] = &[
    (
        "pg_loss",
        "clipped surrogate loss, without the entropy; mean over epochs, as all of these unless something else is said",
    ),
    (
        "agent_grad_norm",
        "norm of the policy's gradient before clipping",
    ),
    ("critic_loss", "loss of the values, in units of returns"),
    (
        "critic_grad_norm",
        "norm of the critic's gradient before clipping",
    ),
    (
        "clipped_share",
        "share of the groups' choices whose ratio is past its bound, in the last epoch",
    ),
    (
        "divergence",
        "mean of ρ − 1 − log ρ over the groups' choices in the last epoch: how far an update moves the policy",
    ),
    (
        "group_entropy",
        "entropy of what a group does, over all ways to it, in nats (of the whole team, an estimate, where ratios are the team's)",
    ),
    (
        "explained_variance",
        "1 − Var(return − V) / Var(return) before the update",
    ),
    ("target_mean", "mean of what values are fitted to"),
    (
        "entropy_weight",
        "weight of the groups' entropy in the latest update",
    ),
    (
        "learning_rate",
        "step size of the controllers in the latest update",
    ),
    (
        "saturation_pair_selector",
        "share of the pair selector's recurrent units with |h| > .99: such units pass nothing on",
    ),
    (
        "saturation_pair_controller",
        "the same, of pair controllers",
    ),
    (
        "saturation_agent_controller",
        "the same, of agent controllers",
    ),
    (
        "logit_variation_pair_selector",
        "standard deviation of a logit of the pair selector over situations, mean over choices: 0 if it does not read its input",
    ),
    (
        "logit_variation_pair_controller",
        "the same, of pair controllers",
    ),
    (
        "logit_variation_agent_controller",
        "the same, of agent controllers",
    ),
    (
        "mackrl/delegation_rate",
        "share of chosen pairs with common knowledge that delegated",
    ),
    (
        "mackrl/delegation_rate_ck_enemies_",
        "the same, for pairs that commonly know this many enemies (Figure 7)",
    ),
    (
        "mackrl/common_knowledge_rate",
        "share of chosen pairs of living agents with common knowledge",
    ),
    (
        "mackrl/ck_entities_mean",
        "entities that a chosen pair of living agents commonly knows",
    ),
    (
        "mackrl/entropy_pair_selector",
        "entropy of the pair selector, in nats",
    ),
    (
        "mackrl/entropy_pair_controller",
        "entropy of chosen pair controllers with common knowledge, in nats",
    ),
    (
        "mackrl/entropy_agent_controller",
        "entropy of living agents' controllers, in nats",
    ),
];
