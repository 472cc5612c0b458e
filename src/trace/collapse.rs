//! Which descendants of a binary tree's node become the children of one wide node.
//!
//! Source: Ylitie, Karras, Laine (2017), *Efficient incoherent ray traversal on GPUs through compressed wide BVHs*, section
//! 3.1, for leaves of one box each: then the leaves cost the same however nodes are collapsed.

/// A node of a binary tree.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BinaryNode {
    /// Half its box's area: the chance that a ray enters it grows with this.
    pub(crate) half_area: f32,
    /// Index of the first child, which the second one follows; `None` for a leaf.
    pub(crate) first_child: Option<u32>,
}

impl BinaryNode {
    fn children(&self) -> Option<[usize; 2]> {
        self.first_child.map(|first| [first as usize, first as usize + 1])
    }
}

/// How to collapse a binary tree to nodes of up to `WIDTH` children such that the sum of their half areas is least.
#[derive(Debug)]
pub(crate) struct Collapse<'a, const WIDTH: usize> {
    tree: &'a [BinaryNode],
    /// For each node, at place n - 1: how many of n places in a wide node its first child takes, the second the rest; 0 if
    /// it needs fewer than n. At place 0 nothing is of meaning: the node itself takes the place.
    first_places: Vec<[u32; WIDTH]>,
}

impl<'a, const WIDTH: usize> Collapse<'a, WIDTH> {
    /// A collapse of the tree whose root comes first; it must have one.
    pub(crate) fn new(tree: &'a [BinaryNode]) -> Self {
        let mut collapse = Self { tree, first_places: vec![[0; WIDTH]; tree.len()] };
        // at place n - 1: the sum of half areas of the wide nodes below n places or fewer
        let mut costs = vec![[0.0_f32; WIDTH]; tree.len()];
        for node in parents_first(tree).into_iter().rev() {
            let Some([a, b]) = tree[node].children() else { continue };
            let (mut cost, mut firsts) = least_costs(&costs[a], &costs[b]);
            cost[0] = tree[node].half_area + cost[WIDTH - 1];
            for places in 2..WIDTH {
                if cost[places - 2] <= cost[places - 1] {
                    cost[places - 1] = cost[places - 2];
                    firsts[places - 1] = 0;
                }
            }
            (costs[node], collapse.first_places[node]) = (cost, firsts);
        }
        collapse
    }

    /// The children of the wide node that a node becomes, in the order of the tree; of a leaf, itself.
    pub(crate) fn children(&self, node: usize, into: &mut Vec<usize>) {
        into.clear();
        self.gather(node, WIDTH, into);
    }

    fn gather(&self, node: usize, places: usize, into: &mut Vec<usize>) {
        let children = if places > 1 { self.tree[node].children() } else { None };
        let Some([a, b]) = children else {
            into.push(node);
            return;
        };
        match self.first_places[node][places - 1] as usize {
            0 => self.gather(node, places - 1, into),
            first => {
                self.gather(a, first, into);
                self.gather(b, places - first, into);
            }
        }
    }
}

/// The least sums of two children's costs for each number of places, and how many of these the first child takes then.
fn least_costs<const WIDTH: usize>(
    first: &[f32; WIDTH],
    second: &[f32; WIDTH],
) -> ([f32; WIDTH], [u32; WIDTH]) {
    let (mut least, mut firsts) = ([f32::INFINITY; WIDTH], [0; WIDTH]);
    for (taken, &cost) in (1..).zip(&first[..WIDTH - 1]) {
        // branches that depend on the costs would be hard to predict
        let rest = &second[..WIDTH - taken as usize];
        let into = least[taken as usize..].iter_mut().zip(&mut firsts[taken as usize..]);
        for ((least, firsts), &rest) in into.zip(rest) {
            let sum = cost + rest;
            *firsts = if sum < *least { taken } else { *firsts };
            *least = if sum < *least { sum } else { *least };
        }
    }
    (least, firsts)
}

/// The nodes below the root, it first, every node after its parent.
fn parents_first(tree: &[BinaryNode]) -> Vec<usize> {
    let mut order = Vec::with_capacity(tree.len());
    order.push(0);
    let mut next = 0;
    while next < order.len() {
        order.extend(tree[order[next]].children().into_iter().flatten());
        next += 1;
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_support::Noise;
    use crate::trace::single_precision::nearest;

    const WIDTH: usize = 4;

    /// A tree of random shape; areas fall with depth.
    fn random_tree(noise: &mut Noise, leaves: usize) -> Vec<BinaryNode> {
        let mut tree = vec![BinaryNode { half_area: 1.0, first_child: None }];
        while tree.len() < 2 * leaves - 1 {
            let leaves = (0..tree.len()).filter(|&node| tree[node].first_child.is_none());
            let drawn = leaves.map(|node| (noise.next(), node)).max_by(|a, b| a.0.total_cmp(&b.0));
            let (_, node) = drawn.expect("a tree has leaves");
            tree[node].first_child = u32::try_from(tree.len()).ok();
            for _ in 0..2 {
                let half_area = tree[node].half_area * nearest(noise.next() + 0.5);
                tree.push(BinaryNode { half_area, first_child: None });
            }
        }
        tree
    }

    /// The least sum by trying every way to open a node's descendants.
    fn least(tree: &[BinaryNode], open: &[usize], places: usize) -> f32 {
        let closed = |&node: &usize| {
            tree[node].children().map_or(0.0, |pair| tree[node].half_area + least(tree, &pair, WIDTH))
        };
        let mut best = open.iter().map(closed).sum::<f32>();
        if open.len() < places {
            for (index, &node) in open.iter().enumerate() {
                if let Some(pair) = tree[node].children() {
                    let mut more = open.to_vec();
                    more.swap_remove(index);
                    more.extend(pair);
                    best = best.min(least(tree, &more, places));
                }
            }
        }
        best
    }

    #[test]
    fn the_sum_of_areas_is_least_and_every_leaf_has_one_place() {
        let mut noise = Noise(7);
        for leaves in 1..11 {
            for _ in 0..4 {
                let tree = random_tree(&mut noise, leaves);
                let collapse = Collapse::<WIDTH>::new(&tree);
                let (mut sum, mut found) = (0.0, 0);
                let (mut open, mut children) = (vec![0], Vec::new());
                while let Some(node) = open.pop() {
                    sum += tree[node].half_area;
                    collapse.children(node, &mut children);
                    assert!((1..=WIDTH).contains(&children.len()));
                    found += children.iter().filter(|&&child| tree[child].first_child.is_none()).count();
                    open.extend(children.iter().filter(|&&child| tree[child].first_child.is_some()));
                }
                assert_eq!(found, leaves);
                if let Some(pair) = tree[0].children() {
                    let want = tree[0].half_area + least(&tree, &pair, WIDTH);
                    assert!((sum - want).abs() < 1e-5 * want, "{leaves} leaves: {sum}, want {want}");
                }
            }
        }
    }
}
