//! On-policy actor-critic learning from the marginal probability of the joint action.
