//! Building a light's tree from the top by the projected-area metric, and what that metric predicts.
//!
//! Known directions make the probability that a ray enters a node its area as the rays see it (Havran 2000): in
//! the perspective space of a light, the area of its rectangle. A ray ends at its receiver, so a node is entered by those
//! alone who are not before the nearest of its casters. Receivers are taken to be spread over the raster, as far as there
//! are casters, and as deep as these:
//!
//! ```text
//! P(node) = area of the rectangle / area with casters * share of casters that are farther than its nearest
//! ```
//!
//! A node's cost is its probability, for its sixteen boxes are tested together; so the tree is cut where the sum of
//! probability times casters is least, among some planes across each axis and depth, and the part with the largest
//! such product is cut next, until there are sixteen. A part of sixteen casters or fewer becomes a node, or lies in its
//! parent's lanes where there are enough left. Casters are parted by size first, so that large ones lie near the root
//! and stretch no boxes.

use rayon::prelude::*;

use crate::kernel::LANES;
use crate::kernel::light_tree::{CASTER, Node};

/// A caster's box: smallest and largest x and y, nearness of the nearest and the farthest point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entry {
    pub(super) bounds: [f32; 6],
    pub(super) prim: u32,
}

impl Entry {
    /// Place on the axes along which parts are cut: the middle, and the nearest point.
    #[inline]
    fn place(&self) -> [f32; 3] {
        let [x0, x1, y0, y1, nearest, _] = self.bounds;
        [x0 + x1, y0 + y1, nearest]
    }
}

/// The box around two.
#[inline]
fn union(a: [f32; 6], b: [f32; 6]) -> [f32; 6] {
    [
        a[0].min(b[0]),
        a[1].max(b[1]),
        a[2].min(b[2]),
        a[3].max(b[3]),
        a[4].max(b[4]),
        a[5].min(b[5]),
    ]
}

const NOTHING: [f32; 6] = [
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::NEG_INFINITY,
    f32::INFINITY,
];

#[inline]
fn area(bounds: &[f32; 6]) -> f32 {
    ((bounds[1] - bounds[0]) * (bounds[3] - bounds[2])).max(0.0)
}

/// How likely a ray enters a box.
#[derive(Clone, Debug)]
pub(super) struct Metric {
    /// Area of the raster over which there are casters.
    covered: f32,
    /// Nearness of the first bin of `farther`, and bins a unit.
    least: f32,
    bins_a_unit: f32,
    /// For each bin, the share of casters farther than its end, by area.
    farther: [f32; DEPTHS],
}

const DEPTHS: usize = 256;

/// Side of the raster on which casters are marked to see how much of it they cover.
const MARKED: usize = 64;

impl Metric {
    /// Of the casters of a raster with this side.
    pub(super) fn of(entries: &[Entry], side: f32) -> Self {
        let known = |entry: &&Entry| entry.bounds[4] < f32::INFINITY;
        let range = |(low, high): (f32, f32), n: f32| (low.min(n), high.max(n));
        let middle = |entry: &Entry| 0.5 * (entry.bounds[4] + entry.bounds[5]);
        let depths = entries.iter().filter(known).map(middle);
        let (least, most) = depths.fold((f32::INFINITY, f32::NEG_INFINITY), range);
        let bins_a_unit = (DEPTHS as f32 - 1.0) / (most - least).max(f32::MIN_POSITIVE);
        let mut metric = Self {
            covered: 0.0,
            least,
            bins_a_unit,
            farther: [0.0; DEPTHS],
        };
        let mut marks = [0u64; MARKED];
        let cell = |v: f32| (v / side * MARKED as f32).clamp(0.0, MARKED as f32 - 1.0) as u32;
        for entry in entries {
            let [x0, x1, y0, y1, ..] = entry.bounds;
            let row = u64::MAX >> (63 - (cell(x1) - cell(x0))) << cell(x0);
            for marks in &mut marks[cell(y0) as usize..=cell(y1) as usize] {
                *marks |= row;
            }
            if known(&entry) {
                metric.farther[metric.bin(middle(entry))] += area(&entry.bounds);
            }
        }
        let cells: u32 = marks.iter().map(|row| row.count_ones()).sum();
        metric.covered = cells as f32 * (side / MARKED as f32) * (side / MARKED as f32);
        let mut sum = 0.0;
        for farther in &mut metric.farther {
            sum += *farther;
            *farther = sum;
        }
        metric
            .farther
            .iter_mut()
            .for_each(|f| *f /= sum.max(f32::MIN_POSITIVE));
        metric
    }

    /// Area of the raster over which there are casters.
    pub(super) fn covered(&self) -> f64 {
        f64::from(self.covered)
    }

    #[inline]
    fn bin(&self, nearness: f32) -> usize {
        // What is no number, as where all are equally near, goes to the first.
        (((nearness - self.least) * self.bins_a_unit) as usize).min(DEPTHS - 1)
    }

    /// Probability that a ray enters a box.
    #[inline]
    pub(super) fn of_box(&self, bounds: &[f32; 6]) -> f32 {
        (area(bounds) / self.covered).min(1.0) * self.farther[self.bin(bounds[4])]
    }
}

/// A tree, and its casters in the order of their lanes.
#[derive(Clone, Debug, Default)]
pub(super) struct Built {
    pub(super) nodes: Vec<Node>,
    pub(super) prims: Vec<u32>,
    /// Sums of the probabilities of all nodes, and of all casters' boxes.
    pub(super) predicted: [f64; 2],
}

/// Shares of the raster's area above which casters are kept apart.
const LARGE: [f32; 2] = [1.0 / 16.0, 1.0 / 512.0];

impl Built {
    /// The tree of these casters, whose order is changed, over a raster of this side; no node if there are none.
    pub(super) fn new(entries: &mut [Entry], metric: &Metric, side: f32) -> Self {
        let mut tree = Self::default();
        if entries.is_empty() {
            return tree;
        }
        let mut parts = Vec::with_capacity(LANES);
        let mut rest = entries;
        for share in LARGE {
            let count = partition(rest, |entry| area(&entry.bounds) > share * side * side);
            let (large, others) = rest.split_at_mut(count);
            parts.extend(Part::of(large, metric));
            rest = others;
        }
        parts.extend(Part::of(rest, metric));
        let (root, mut lane, parts) = tree.start(parts, metric);
        let below: Vec<([f32; 6], Self)> = parts
            .into_par_iter()
            .map(|part| {
                let (bounds, mut below) = (part.bounds, Self::default());
                below.grow(part, metric);
                (bounds, below)
            })
            .collect();
        for (bounds, below) in below {
            let child = tree.append(below);
            tree.set(root, lane, (bounds, child));
            lane += 1;
        }
        tree
    }

    /// Adds a node and all that is below it; returns its position.
    fn grow(&mut self, part: Part, metric: &Metric) -> u32 {
        let (node, mut lane, parts) = self.start(vec![part], metric);
        for part in parts {
            let bounds = part.bounds;
            let child = self.grow(part, metric);
            self.set(node, lane, (bounds, child));
            lane += 1;
        }
        node as u32
    }

    /// Adds a node over these parts, with the casters that lie in its own lanes; returns its position, the next lane and
    /// the parts that become nodes below it.
    fn start<'e>(&mut self, parts: Vec<Part<'e>>, metric: &Metric) -> (usize, usize, Vec<Part<'e>>) {
        let bounds = parts.iter().fold(NOTHING, |all, part| union(all, part.bounds));
        self.predicted[0] += f64::from(metric.of_box(&bounds));
        let node = self.nodes.len();
        self.nodes.push(Node::default());
        let (dissolved, parts) = cut(parts, metric);
        let mut lane = 0;
        for entry in dissolved.iter().flat_map(|part| &*part.entries) {
            self.predicted[1] += f64::from(metric.of_box(&entry.bounds));
            let child = self.prims.len() as u32 | CASTER;
            self.prims.push(entry.prim);
            self.set(node, lane, (entry.bounds, child));
            lane += 1;
        }
        (node, lane, parts)
    }

    fn set(&mut self, node: usize, lane: usize, (bounds, child): ([f32; 6], u32)) {
        let node = &mut self.nodes[node];
        node.boxes.set(lane, bounds);
        node.child[lane] = child;
    }

    /// Adds all of another tree; returns the position of its root.
    fn append(&mut self, other: Self) -> u32 {
        let (nodes, prims) = (self.nodes.len() as u32, self.prims.len() as u32);
        self.nodes.extend(other.nodes.into_iter().map(|mut node| {
            for child in &mut node.child {
                *child += if *child & CASTER == 0 { nodes } else { prims };
            }
            node
        }));
        self.prims.extend(other.prims);
        for (sum, own) in self.predicted.iter_mut().zip(other.predicted) {
            *sum += own;
        }
        nodes
    }
}

/// Some casters, to be cut.
struct Part<'e> {
    entries: &'e mut [Entry],
    bounds: [f32; 6],
    /// Probability that a ray enters it.
    probability: f32,
}

impl<'e> Part<'e> {
    /// `None` of no casters.
    fn of(entries: &'e mut [Entry], metric: &Metric) -> Option<Self> {
        if entries.is_empty() {
            return None;
        }
        let bounds = entries
            .iter()
            .fold(NOTHING, |all, entry| union(all, entry.bounds));
        Some(Self {
            probability: metric.of_box(&bounds),
            bounds,
            entries,
        })
    }

    fn cost(&self) -> f32 {
        self.probability * self.entries.len() as f32
    }

    /// Cuts it in two where the sum of their costs is least.
    fn split(self, metric: &Metric) -> [Option<Self>; 2] {
        let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        for entry in &*self.entries {
            let at = entry.place();
            for axis in 0..3 {
                low[axis] = low[axis].min(at[axis]);
                high[axis] = high[axis].max(at[axis]);
            }
        }
        let scale = [0, 1, 2].map(|axis| BINS as f32 / (high[axis] - low[axis]));
        let bin = |at: [f32; 3], axis: usize| (((at[axis] - low[axis]) * scale[axis]) as usize).min(BINS - 1);
        let mut bins = [[(0u32, NOTHING); BINS]; 3];
        for entry in &*self.entries {
            let at = entry.place();
            for (axis, bins) in bins.iter_mut().enumerate() {
                let (count, bounds) = &mut bins[bin(at, axis)];
                *count += 1;
                *bounds = union(*bounds, entry.bounds);
            }
        }
        let best = (0..3)
            .filter(|&axis| scale[axis].is_finite() && scale[axis] > 0.0)
            .filter_map(|axis| best_cut(&bins[axis], metric).map(|(cost, last)| (cost, axis, last)))
            .reduce(|a, b| if b.0 < a.0 { b } else { a });
        let count = match best {
            Some((_, axis, last)) => partition(self.entries, |entry| bin(entry.place(), axis) <= last),
            // All in one place.
            None => self.entries.len() / 2,
        };
        let (before, after) = self.entries.split_at_mut(count);
        [Part::of(before, metric), Part::of(after, metric)]
    }
}

/// Bins of an axis, between which a part may be cut.
const BINS: usize = 12;

/// The cheapest cut, as its cost and the last bin before it.
fn best_cut(bins: &[(u32, [f32; 6]); BINS], metric: &Metric) -> Option<(f32, usize)> {
    let cost = |count: u32, bounds: &[f32; 6]| count as f32 * metric.of_box(bounds);
    let mut after = [(0, 0.0); BINS];
    let (mut count, mut bounds) = (0, NOTHING);
    for i in (1..BINS).rev() {
        count += bins[i].0;
        bounds = union(bounds, bins[i].1);
        after[i - 1] = (count, cost(count, &bounds));
    }
    let (mut count, mut bounds) = (0, NOTHING);
    let mut best = None;
    for last in 0..BINS - 1 {
        count += bins[last].0;
        bounds = union(bounds, bins[last].1);
        let (others, behind) = after[last];
        if count == 0 || others == 0 {
            continue;
        }
        let sum = cost(count, &bounds) + behind;
        if best.is_none_or(|(least, _)| sum < least) {
            best = Some((sum, last));
        }
    }
    best
}

/// Cuts parts until there are sixteen, or none with more than sixteen casters. First those whose casters lie in the
/// node's own lanes, then those that become nodes.
fn cut<'e>(mut parts: Vec<Part<'e>>, metric: &Metric) -> (Vec<Part<'e>>, Vec<Part<'e>>) {
    while parts.len() < LANES {
        let many = parts
            .iter()
            .enumerate()
            .filter(|(_, part)| part.entries.len() > LANES);
        let Some((worst, _)) = many.max_by(|a, b| a.1.cost().total_cmp(&b.1.cost())) else {
            break;
        };
        let part = parts.swap_remove(worst);
        parts.extend(part.split(metric).into_iter().flatten());
    }
    let mut lanes = parts.len();
    parts.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    parts.into_iter().partition(|part| {
        let more = part.entries.len() - 1;
        let fits = lanes + more <= LANES;
        if fits {
            lanes += more;
        }
        fits
    })
}

/// Moves the entries for which `first` holds before the others; returns their number.
fn partition(entries: &mut [Entry], first: impl Fn(&Entry) -> bool) -> usize {
    let mut count = 0;
    for i in 0..entries.len() {
        if first(&entries[i]) {
            entries.swap(i, count);
            count += 1;
        }
    }
    count
}
