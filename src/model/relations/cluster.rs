//! Which of many values are one and the same.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use super::chi2::survival;
use super::estimate::Estimate;
use crate::fit::constant::constants;

constants! {
    /// Natural logarithm of the odds at which a relation is told.
    pub ODDS: f64 = 2.3, Derived("ten to one");
    /// Probability of a larger deviation than one, if the relation holds, below which it is held to be none.
    pub COMPATIBLE: f64 = 1e-6, Trial(1e-7, 1e-4);
    /// How often the share of values that are one is learned from what was found with the share before.
    ROUNDS: usize = 6, Effort("rounds");
}

/// Values that are one.
#[derive(Clone, Debug)]
pub struct Group<T> {
    /// Their places, in order.
    pub members: Vec<usize>,
    /// What they tell together.
    pub value: T,
    /// Natural logarithm of the odds that the member of which that is the least sure belongs to the others.
    pub odds: f64,
    /// Natural logarithm of the odds that they are one against that none are: those of its members, of which the first is
    /// free.
    pub weight: f64,
}

/// Groups of values that are one, each value in exactly one of them, by a Bayesian choice between "one and the same" and
/// "any two values of their volume".
///
/// The prior is a Chinese restaurant process (Aldous, 1985), whose concentration, that is how often two values of this
/// kind are one, comes from the values themselves: where many differ, those that coincide do so by chance. Groups are
/// joined in the order of their evidence while that is for it and their difference stays compatible with none (Heller and
/// Ghahramani, Bayesian hierarchical clustering, 2005). Members of which all others do not say with the odds [`ODDS`] that
/// they belong to them stand alone.
pub fn cluster<const D: usize, T: Estimate<D>>(items: &[T]) -> Vec<Group<T>> {
    let pairs = (items.len() * items.len().saturating_sub(1) / 2) as f64;
    let mut concentration = 1.0;
    let mut groups = sure(joined(items, concentration), items, concentration);
    for _ in 0..ROUNDS.get() {
        let same: usize = groups.iter().map(|g| g.members.len() * (g.members.len() - 1) / 2).sum();
        // two values are one with probability 1 / (1 + concentration); half a pair stands for what was not seen
        let next = (pairs + 1.0) / (same as f64 + 0.5) - 1.0;
        if next == concentration {
            break;
        }
        concentration = next;
        groups = sure(joined(items, concentration), items, concentration);
    }
    groups.sort_by_key(|g| g.members[0]);
    groups
}

/// The groups without the members that hardly belong to them; these stand alone.
fn sure<const D: usize, T: Estimate<D>>(
    groups: Vec<Group<T>>,
    items: &[T],
    concentration: f64,
) -> Vec<Group<T>> {
    let mut out = Vec::new();
    for mut group in groups {
        while group.members.len() > 1 {
            let belongs = |&m: &usize| {
                let others = all_but(items, &group.members, m);
                let odds = others.and_then(|o| odds(&o, &items[m], [group.members.len() - 1, 1]));
                odds.map_or(f64::NEG_INFINITY, |odds| odds - concentration.ln())
            };
            let odds: Vec<f64> = group.members.iter().map(belongs).collect();
            let least = (0..odds.len()).min_by(|&a, &b| odds[a].total_cmp(&odds[b])).unwrap_or(0);
            group.odds = odds[least];
            let size = odds.len() as f64;
            group.weight = odds.iter().sum::<f64>() * (size - 1.0) / size;
            if group.odds > ODDS.get() {
                break;
            }
            let alone = group.members.remove(least);
            out.push(Group {
                members: vec![alone],
                value: items[alone].clone(),
                odds: f64::INFINITY,
                weight: 0.0,
            });
        }
        if group.members.len() < 2 {
            (group.odds, group.weight) = (f64::INFINITY, 0.0);
        }
        let members = group.members.iter().map(|&m| Some(items[m].clone()));
        if let Some(value) = members.reduce(|a, b| a?.joined(&b?)).flatten() {
            out.push(Group { value, ..group });
        }
    }
    out
}

/// What all members of a group but one tell.
pub fn all_but<const D: usize, T: Estimate<D>>(
    items: &[T],
    members: &[usize],
    one: usize,
) -> Option<T> {
    let others = members.iter().filter(|&&k| k != one).map(|&k| Some(items[k].clone()));
    others.reduce(|a, b| a?.joined(&b?)).flatten()
}

/// Odds that two groups of so many values are one, at a concentration of one; `None` where they cannot be.
fn odds<const D: usize, T: Estimate<D>>(a: &T, b: &T, sizes: [usize; 2]) -> Option<f64> {
    let gap = a.gap(b)?;
    if survival(gap.chi2()?, D) < COMPATIBLE.get() {
        return None;
    }
    Some(gap.evidence(a.volume())? + seating(sizes[0], sizes[1]))
}

/// A step that may be taken: odds, and the two groups with the versions they had.
struct Step {
    odds: f64,
    groups: [usize; 2],
}

impl Step {
    fn rank(&self, other: &Self) -> Ordering {
        self.odds.total_cmp(&other.odds).then_with(|| other.groups.cmp(&self.groups))
    }
}

impl PartialEq for Step {
    fn eq(&self, other: &Self) -> bool {
        self.rank(other) == Ordering::Equal
    }
}

impl Eq for Step {}

impl PartialOrd for Step {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Step {
    fn cmp(&self, other: &Self) -> Ordering {
        self.rank(other)
    }
}

fn joined<const D: usize, T: Estimate<D>>(items: &[T], concentration: f64) -> Vec<Group<T>> {
    let single = |(k, item): (usize, &T)| {
        Some(Group { members: vec![k], value: item.clone(), odds: f64::INFINITY, weight: 0.0 })
    };
    // a group that is joined to another leaves its place; the joined one takes a new one
    let mut groups: Vec<Option<Group<T>>> = items.iter().enumerate().map(single).collect();
    let mut steps = BinaryHeap::new();
    for a in 0..groups.len() {
        steps.extend((0..a).filter_map(|b| step(&groups, [b, a], concentration)));
    }
    while let Some(Step { odds, groups: [a, b] }) = steps.pop() {
        let (Some(first), Some(second)) = (&groups[a], &groups[b]) else { continue };
        let Some(value) = first.value.joined(&second.value) else { continue };
        let mut members = [&first.members[..], &second.members[..]].concat();
        members.sort_unstable();
        (groups[a], groups[b]) = (None, None);
        groups.push(Some(Group { members, value, odds, weight: 0.0 }));
        let last = groups.len() - 1;
        steps.extend((0..last).filter_map(|k| step(&groups, [k, last], concentration)));
    }
    groups.into_iter().flatten().collect()
}

/// The step that joins two groups, where it may be taken.
fn step<const D: usize, T: Estimate<D>>(
    groups: &[Option<Group<T>>],
    pair: [usize; 2],
    concentration: f64,
) -> Option<Step> {
    let [a, b] = pair.map(|k| groups[k].as_ref());
    let (a, b) = (a?, b?);
    let odds = odds(&a.value, &b.value, [a.members.len(), b.members.len()])? - concentration.ln();
    (odds > 0.0).then_some(Step { odds, groups: pair })
}

/// Logarithm of (a + b - 1)! / ((a - 1)! (b - 1)!): by how much the process prefers one group to two of these sizes, at
/// a concentration of one.
fn seating(a: usize, b: usize) -> f64 {
    let factorial = |n: usize| libm::lgamma(n as f64 + 1.0);
    factorial(a + b - 1) - factorial(a - 1) - factorial(b - 1)
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix1, Matrix2, SMatrix, Vector1};

    use super::super::estimate::Place;
    use super::*;

    fn value(x: f64, deviation: f64) -> Place<1> {
        Place {
            x: Vector1::new(x),
            covariance: Matrix1::new(deviation * deviation),
            drift: SMatrix::zeros(),
            direction: Matrix2::zeros(),
            volume: 100.0,
        }
    }

    fn members(groups: &[Group<Place<1>>]) -> Vec<Vec<usize>> {
        groups.iter().map(|g| g.members.clone()).collect()
    }

    #[test]
    fn values_that_agree_are_one_and_their_mean_is_that_of_least_variance() {
        let items = [value(5.0, 0.01), value(9.0, 0.01), value(5.01, 0.02), value(4.99, 0.01)];
        let groups = cluster(&items);
        assert_eq!(members(&groups), [vec![0, 2, 3], vec![1]]);
        let weights = [1e4, 2.5e3, 1e4];
        let mean = (5.0 * weights[0] + 5.01 * weights[1] + 4.99 * weights[2]) / 2.25e4;
        assert!((groups[0].value.x[0] - mean).abs() < 1e-12);
        assert!((groups[0].value.covariance[0] - 1.0 / 2.25e4).abs() < 1e-12);
    }

    #[test]
    fn what_is_not_known_well_says_nothing() {
        // a deviation that is nothing beside its uncertainty, which is a good part of all there may be
        let items = [value(5.0, 10.0), value(5.1, 10.0)];
        assert_eq!(members(&cluster(&items)), [[0], [1]]);
    }

    #[test]
    fn among_many_unlike_values_some_agree_by_chance_and_are_not_told() {
        // 200 values over 100 with 0.01: forty pairs or so are within two deviations of each other
        let golden = |k: usize| (k as f64 * 0.618_033_988_75).fract() * 100.0;
        let mut unlike: Vec<Place<1>> = (0..200).map(|k| value(golden(k * k), 0.01)).collect();
        let near = |a: &Place<1>, b: &Place<1>| (a.x - b.x).norm() < 0.02;
        let pairs = (0..200).flat_map(|b| (0..b).map(move |a| (a, b)));
        assert!(pairs.filter(|&(a, b)| near(&unlike[a], &unlike[b])).count() > 3);
        assert!(cluster(&unlike).iter().all(|g| g.members.len() == 1));
        // ten that are one still are
        unlike.extend((0..10).map(|k| value(50.0 + 0.003 * k as f64, 0.01)));
        let groups = cluster(&unlike);
        let largest = groups.iter().max_by_key(|g| g.members.len()).unwrap();
        assert!((200..210).all(|k| largest.members.contains(&k)) && largest.members.len() < 13);
    }

    #[test]
    fn a_value_that_the_others_contradict_stands_alone() {
        let mut items: Vec<Place<1>> =
            (0..8).map(|k| value(7.0 + 0.001 * k as f64, 0.01)).collect();
        items.push(value(7.1, 0.01));
        assert_eq!(members(&cluster(&items)), [vec![0, 1, 2, 3, 4, 5, 6, 7], vec![8]]);
        assert!(cluster::<1, Place<1>>(&[]).is_empty());
    }
}
