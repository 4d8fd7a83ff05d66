//! Every partition of a small team.

use mackrl_env::AgentId;

use super::Partition;

/// Number of partitions of `agents` into pairs with at most one singleton: 1, 1, 3, 3, 15, 15, 105, 105, 945, … for 1, 2,
/// 3, …; at most `u128::MAX` is returned.
///
/// # Equation
/// (N−1)!! for even N; N!! for odd N, since a fictitious partner of the singleton makes the team even.
#[must_use]
pub fn partition_count(agents: usize) -> u128 {
    let even = agents + agents % 2;
    (1..even)
        .step_by(2)
        .fold(1, |count: u128, odd| count.saturating_mul(odd as u128))
}

/// All partitions of `agents`. If their number is odd, those that leave out agent 0 come first, then those that leave out
/// agent 1 and so on; within these, the lowest agent meets its partners in ascending order.
///
/// Takes time and memory proportional to [`partition_count`]; [`super::PartitionSchedule`] guards against large teams.
#[must_use]
pub fn all_partitions(agents: usize) -> Vec<Partition> {
    let team: Vec<AgentId> = (0..agents).map(AgentId::new).collect();
    let mut partitions = Vec::new();
    if agents.is_multiple_of(2) {
        extend_matchings(&mut Vec::new(), &team, &[], &mut partitions);
    } else {
        for &left_out in &team {
            let rest: Vec<AgentId> = team.iter().copied().filter(|&a| a != left_out).collect();
            extend_matchings(&mut Vec::new(), &rest, &[left_out], &mut partitions);
        }
    }
    partitions
}

/// Appends the partitions that begin with the couples of `order`, match `rest` in every way and end with `last`.
fn extend_matchings(
    order: &mut Vec<AgentId>,
    rest: &[AgentId],
    last: &[AgentId],
    partitions: &mut Vec<Partition>,
) {
    let Some((&lowest, others)) = rest.split_first() else {
        let whole: Vec<AgentId> = order.iter().chain(last).copied().collect();
        partitions.push(Partition::from_order(&whole));
        return;
    };
    for &partner in others {
        let remaining: Vec<AgentId> = others.iter().copied().filter(|&a| a != partner).collect();
        order.extend([lowest, partner]);
        extend_matchings(order, &remaining, last, partitions);
        order.truncate(order.len() - 2);
    }
}

/// Every way to divide `members` into groups of `size` and one smaller group of what is left, if anything is left: those
/// that leave out the first members come first. Each group is in the order of `members`; the smaller one is the last.
///
/// # Panics
/// If `size` is 0.
#[must_use]
pub fn ways_to_divide(members: &[AgentId], size: usize) -> Vec<Vec<Vec<AgentId>>> {
    assert!(size > 0, "a group has a member");
    let left = members.len() % size;
    if left > 0 {
        let ways = choices(members, left).into_iter();
        return ways
            .flat_map(|(last, rest)| {
                let mut ways = ways_to_divide(&rest, size);
                ways.iter_mut().for_each(|way| way.push(last.clone()));
                ways
            })
            .collect();
    }
    let Some((&first, others)) = members.split_first() else {
        return vec![Vec::new()];
    };
    let ways = choices(others, size - 1).into_iter();
    ways.flat_map(|(companions, rest)| {
        let group: Vec<AgentId> = [first].into_iter().chain(companions).collect();
        let ways = ways_to_divide(&rest, size).into_iter();
        let with_group = ways.map(move |way| [vec![group.clone()], way].concat());
        with_group.collect::<Vec<_>>()
    })
    .collect()
}

/// Every choice of `count` of `members`, and those that are left, both in their order.
fn choices(members: &[AgentId], count: usize) -> Vec<(Vec<AgentId>, Vec<AgentId>)> {
    let Some((&first, others)) = members.split_first() else {
        let nothing = (Vec::new(), Vec::new());
        return if count == 0 {
            vec![nothing]
        } else {
            Vec::new()
        };
    };
    let mut found = Vec::new();
    if count > 0 {
        for (mut chosen, rest) in choices(others, count - 1) {
            chosen.insert(0, first);
            found.push((chosen, rest));
        }
    }
    for (chosen, mut rest) in choices(others, count) {
        rest.insert(0, first);
        found.push((chosen, rest));
    }
    found
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn there_are_as_many_distinct_partitions_as_the_double_factorial_says() {
        let expected = [1, 1, 3, 3, 15, 15, 105, 105];
        for (agents, count) in (1..=8).zip(expected) {
            let partitions = all_partitions(agents);
            assert_eq!(partitions.len(), count, "{agents} agents");
            assert_eq!(partition_count(agents), count as u128);
            let distinct: BTreeSet<_> = partitions.iter().collect();
            assert_eq!(distinct.len(), count, "{agents} agents");
            assert!(
                partitions
                    .iter()
                    .all(|partition| partition.agents() == agents),
                "a partition lacks an agent"
            );
        }
        assert_eq!(partition_count(10), 945);
        assert_eq!(partition_count(27), 213_458_046_676_875);
        assert_eq!(partition_count(128), u128::MAX);
    }

    #[test]
    fn a_team_of_one_is_a_singleton() {
        let partitions = all_partitions(1);
        assert!(partitions[0].pairs().is_empty());
        assert_eq!(partitions[0].singleton(), Some(AgentId::new(0)));
    }

    #[test]
    fn odd_teams_leave_out_their_agents_in_order() {
        let left_out: Vec<usize> = all_partitions(5)
            .iter()
            .filter_map(|partition| partition.singleton().map(AgentId::index))
            .collect();
        assert_eq!(left_out, [0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 3, 4, 4, 4]);
    }

    #[test]
    fn ways_to_divide_into_pairs_are_the_partitions() {
        for agents in 0..=7 {
            let team: Vec<AgentId> = (0..agents).map(AgentId::new).collect();
            let mut found: Vec<Partition> = ways_to_divide(&team, 2)
                .iter()
                .map(|way| Partition::from_order(&way.concat()))
                .collect();
            let mut expected = all_partitions(agents);
            found.sort();
            expected.sort();
            assert_eq!(found, expected, "{agents} agents");
        }
    }

    #[test]
    fn what_is_left_of_groups_of_four_comes_last() {
        let team: Vec<AgentId> = (0..6).map(AgentId::new).collect();
        let ways = ways_to_divide(&team, 4);
        assert_eq!(ways.len(), 15);
        assert!(
            ways.iter()
                .all(|way| way[0].len() == 4 && way[1].len() == 2)
        );
    }
}
