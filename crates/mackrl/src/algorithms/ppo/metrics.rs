//! What the learners report, explained.

/// What is reported.
pub(super) const METRICS: &[(&str, &str)] = &[
    (
        "pg_loss",
        "clipped surrogate loss, the private loss included, without the entropy; mean over epochs, as all of these unless something else is said",
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
];
