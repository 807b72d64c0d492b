//! Sets that join: which points hang together.

/// Disjoint sets of `0..n` with path halving; a set's root is its smallest member.
pub struct Union(Vec<u32>);

impl Union {
    /// `n` sets of one member each.
    pub fn new(n: usize) -> Self {
        Self((0..n as u32).collect())
    }

    /// The root of the set that holds `i`.
    pub fn root(&mut self, mut i: u32) -> u32 {
        while self.0[i as usize] != i {
            let up = self.0[self.0[i as usize] as usize];
            self.0[i as usize] = up;
            i = up;
        }
        i
    }

    /// Joins the sets of `a` and `b`.
    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }

    /// The sets, larger ones first, then by smallest member; members rise.
    pub fn sets(mut self) -> Vec<Vec<u32>> {
        let n = self.0.len();
        let mut of_root = vec![Vec::new(); n];
        for i in 0..n as u32 {
            of_root[self.root(i) as usize].push(i);
        }
        of_root.retain(|s| !s.is_empty());
        of_root.sort_by_key(|s| std::cmp::Reverse(s.len()));
        of_root
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn joined_members_share_a_set_whatever_the_order() {
        let mut union = Union::new(6);
        union.join(5, 3);
        union.join(4, 1);
        union.join(3, 1);
        assert_eq!(union.sets(), [vec![1, 3, 4, 5], vec![0], vec![2]]);
        assert!(Union::new(0).sets().is_empty());
    }
}
