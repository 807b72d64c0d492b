//! The search for relations: what all steps of it share.

use nalgebra::{DMatrix, SMatrix};

use super::chi2::survival;
use super::cluster::{COMPATIBLE, Group, ODDS, all_but};
use super::constraint::Constraint;
use super::estimate::{Direction, Estimate};
use super::face::Face;
use super::frame::Frame;
use super::joint::{Innovation, Joint, farthest};
use super::told::{Relation, RelationKind};
use crate::fit::constant::constants;

/// What is told of surfaces that are under some constraints.
pub struct Accepted {
    /// The relations that are told of it.
    pub relations: Vec<Relation>,
    /// What they ask of the surfaces.
    pub constraints: Vec<Constraint>,
    /// Places of those among all that were found without which they mean nothing.
    pub needs: Vec<usize>,
}

impl Accepted {
    /// One relation.
    pub fn one(relation: Relation, constraints: Vec<Constraint>, needs: Vec<usize>) -> Self {
        Self { relations: vec![relation], constraints, needs }
    }

    /// Odds of the surest of its relations.
    pub fn odds(&self) -> f64 {
        self.relations.iter().map(|r| r.log_odds).fold(f64::NEG_INFINITY, f64::max)
    }
}

/// Faces with a common direction.
pub struct Bundle {
    /// Their places, in order.
    pub faces: Vec<usize>,
    /// The face whose direction is known best.
    pub hub: usize,
    /// The common direction.
    pub direction: Direction,
    /// Where its relation stands among what was found; none of a single face.
    pub accepted: Option<usize>,
}

/// The search.
pub struct Search<'a> {
    /// The surfaces.
    pub faces: &'a [Face],
    /// Their frame.
    pub frame: Frame,
    /// All that was accepted, as equations.
    pub joint: Joint<'a>,
    /// What was found.
    pub found: Vec<Accepted>,
}

constants! {
    /// Largest residual of an equation that follows from others, in the standard deviations that it has without them.
    CONTRADICTED: f64 = 0.5, Derived("those that agree differ in the second order of deviations alone, those that do not by about one");
}

impl<'a> Search<'a> {
    pub fn new(faces: &'a [Face], frame: Frame) -> Self {
        let joint = Joint::new(faces);
        Self { faces, frame, joint, found: Vec::new() }
    }

    /// Adds what was accepted to what was found, and says where it stands there.
    pub fn tell(&mut self, accepted: Accepted) -> usize {
        self.found.push(accepted);
        self.found.len() - 1
    }

    /// Makes the equations linear beside surfaces for which all that was accepted so far holds, or nearly.
    pub fn settle(&mut self) {
        let at = self.joint.solved().0;
        let constraints = || self.found.iter().flat_map(|a| &a.constraints);
        let off = farthest(self.faces, &at, constraints());
        let mut joint = Joint::beside(self.faces, at, Some(off));
        for constraint in constraints() {
            joint.add(constraint);
        }
        self.joint = joint;
    }

    /// Adds a constraint to all that was accepted, unless it is not compatible with that.
    pub fn take(&mut self, constraint: &Constraint) -> Option<Innovation> {
        let rank = self.joint.rank();
        let innovation = self.joint.add(constraint);
        let fits = innovation.probability() >= COMPATIBLE.get();
        if fits && innovation.contradiction < CONTRADICTED.get() {
            return Some(innovation);
        }
        self.joint.truncate(rank);
        None
    }

    /// What a constraint would add.
    pub fn ask(&mut self, constraint: &Constraint) -> Innovation {
        let rank = self.joint.rank();
        let innovation = self.joint.add(constraint);
        self.joint.truncate(rank);
        innovation
    }

    /// Region ids of faces.
    pub fn regions(&self, faces: &[usize]) -> Vec<usize> {
        faces.iter().map(|&f| self.faces[f].region).collect()
    }

    /// Accepts a group of values that are one: each of its members but the hub by the constraint that `bind` makes. Gives
    /// the members that stayed, by their places in the group's items, the hub among them.
    pub fn take_group<T>(
        &mut self,
        group: &Group<T>,
        hub: usize,
        bind: impl Fn(usize) -> Vec<Constraint>,
    ) -> (Vec<usize>, Vec<Constraint>) {
        let (mut stayed, mut constraints) = (vec![hub], Vec::new());
        for &member in group.members.iter().filter(|m| **m != hub) {
            let rank = self.joint.rank();
            let asked = bind(member);
            if asked.iter().all(|c| self.take(c).is_some()) {
                stayed.push(member);
                constraints.extend(asked);
            } else {
                self.joint.truncate(rank);
            }
        }
        stayed.sort_unstable();
        (stayed, constraints)
    }
}

/// How often what may be is, where that is learned from the evidence for it: the share of `all` of which it is sure enough
/// with that share itself; at most a half, and half of one stands for what was not seen.
pub fn learned_share(evidence: &[f64], all: f64) -> f64 {
    let (mut share, mut count) = (0.5_f64, usize::MAX);
    loop {
        let now = evidence.iter().filter(|e| **e + log_odds(share) > ODDS.get()).count();
        if now >= count {
            return share;
        }
        count = now;
        share = ((count as f64 + 0.5) / (all + 1.0)).min(0.5);
    }
}

/// Logarithm of the odds of a probability.
pub fn log_odds(probability: f64) -> f64 {
    (probability / (1.0 - probability)).ln()
}

/// What the members of a group say of each other.
pub struct Spread {
    /// The largest deviation, in standard uncertainties, of one from what the others tell, and its uncertainty.
    pub worst: (f64, f64),
    /// Probability of deviations at least so large.
    pub p_value: f64,
}

/// How far each of `members` is from what the others tell.
pub fn spread<const D: usize, T: Estimate<D>>(items: &[T], members: &[usize]) -> Option<Spread> {
    let mut worst: Option<(f64, (f64, f64))> = None;
    let mut total = 0.0;
    let mut so_far: Option<T> = None;
    for &m in members {
        let others = all_but(items, members, m)?;
        let gap = others.gap(&items[m])?;
        let chi2 = gap.chi2()?;
        if worst.is_none_or(|w| chi2 > w.0) {
            worst = Some((chi2, gap.length()));
        }
        so_far = match so_far {
            None => Some(items[m].clone()),
            Some(so_far) => {
                total += so_far.gap(&items[m])?.chi2()?;
                so_far.joined(&items[m])
            }
        };
    }
    let p_value = survival(total, D * members.len().saturating_sub(1));
    Some(Spread { worst: worst?.1, p_value })
}

impl Spread {
    /// A relation between `regions` with these deviations, lengths in units of `unit`.
    pub fn relation(
        &self,
        kind: RelationKind,
        regions: Vec<usize>,
        odds: f64,
        unit: f64,
    ) -> Relation {
        Relation {
            deviation: self.worst.0 * unit,
            uncertainty: self.worst.1 * unit,
            p_value: self.p_value,
            log_odds: odds,
            ..Relation::new(kind, regions)
        }
    }
}

/// A covariance as one of fixed size.
pub fn part<const D: usize>(of: &DMatrix<f64>) -> SMatrix<f64, D, D> {
    SMatrix::from_fn(|i, j| (of[(i, j)] + of[(j, i)]) / 2.0)
}
