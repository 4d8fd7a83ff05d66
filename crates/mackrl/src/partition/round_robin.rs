//! A tournament: every pair meets once before any meets again.

use mackrl_env::AgentId;

/// Steps after which every pair has met exactly once: N − 1 for even N, N for odd N, and 1 for a single agent.
pub(super) const fn period(agents: usize) -> usize {
    let even = agents + agents % 2;
    if even > 1 { even - 1 } else { 1 }
}

/// Writes the order whose couples meet in `round`, by the circle method: one player stays, the others sit on a circle that
/// turns by one place a round, and opposite places meet. In an odd team the player who stays is fictitious and whoever
/// meets it is alone.
///
/// `relabelled` says which agent plays as player 0, 1, …; `order` receives as many agents.
pub(super) fn write_round(relabelled: &[AgentId], round: usize, order: &mut Vec<AgentId>) {
    let agents = relabelled.len();
    let places = period(agents);
    let turn = round % places;
    order.clear();
    for distance in 1..=(places - 1) / 2 {
        order.push(relabelled[(turn + distance) % places]);
        order.push(relabelled[(turn + places - distance) % places]);
    }
    order.push(relabelled[turn]);
    if agents > places {
        order.push(relabelled[places]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::partition::{Pairs, Partition};

    #[test]
    fn every_pair_meets_exactly_once_in_a_period() {
        for agents in 1..=13 {
            let relabelled: Vec<AgentId> = (0..agents).rev().map(AgentId::new).collect();
            let mut order = Vec::new();
            let mut meetings = vec![0; Pairs::count_for(agents)];
            let mut alone = vec![0; agents];
            for round in 0..period(agents) {
                write_round(&relabelled, round, &mut order);
                let partition = Partition::from_order(&order);
                for pair in partition.pairs() {
                    meetings[pair.index()] += 1;
                }
                if let Some(agent) = partition.singleton() {
                    alone[agent.index()] += 1;
                }
            }
            assert!(
                meetings.iter().all(|&count| count == 1),
                "{agents} agents meet {meetings:?}"
            );
            assert!(
                alone.iter().all(|&count| count == agents % 2),
                "{agents} agents are alone {alone:?}"
            );
        }
    }
}
