//! Which stems are solid: those whose surface encloses something, whatever they are called.
//!
//! What CAN calls a stem may be a pot, a gutter, a board or a wide tube of one sheet, and light gets into these. So
//! triangles of stems that hang together are a component, and a component is solid if it is closed or nearly so: if
//! what would close its open rims is a small part of its surface. Tubes of a stem that end where others begin are one.

use std::collections::HashMap;

use glam::DVec3;

use super::Canopy;
use crate::geometry::{area, doubled_area_vector};

/// What would close the rims of a solid is at most this part of all of its surface: an open tube more than nine times as
/// long as its radius is solid, a pot less than four times as deep as its radius is not.
const OPEN_AT_MOST: f64 = 0.1;

/// Rims whose centres are closer than this part of the larger one's radius lie on one another.
const RIMS_MEET: f64 = 0.3;

/// The solid parts of a canopy.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Solids {
    /// Whether the lower face of each triangle is the inside of something solid.
    pub solid: Vec<bool>,
    /// Triangles of solids that are turned inside out: their lower faces look outwards.
    pub inside_out: Vec<u32>,
}

/// Rims that lie on one another have radii within this factor.
const RIMS_ALIKE: f64 = 3.0;

/// A vertex, bit by bit.
type Vertex = [u64; 3];

/// A triangle of a stem, its vertices by number.
struct Facet {
    triangle: u32,
    corners: [u32; 3],
}

/// The triangles that may be solid of a plant.
#[derive(Default)]
struct Surface {
    facets: Vec<Facet>,
    points: Vec<DVec3>,
    /// Triangles that stand where a facet does, the facet's triangle, and whether both look the same way.
    twins: Vec<(u32, u32, bool)>,
}

/// The open edges that hang together.
struct Rim {
    centre: DVec3,
    /// Of the surface that would close it.
    area_m2: f64,
    component: u32,
}

impl Solids {
    /// Of the triangles of a canopy that may be solid.
    pub(super) fn of(canopy: &Canopy, may_be_solid: &[bool]) -> Self {
        let mut solids = Self {
            solid: vec![false; canopy.len()],
            inside_out: Vec::new(),
        };
        if !may_be_solid.contains(&true) {
            return solids;
        }
        let mut plants: HashMap<(&str, &str), Vec<u32>> = HashMap::new();
        for (number, triangle) in canopy.triangles().enumerate() {
            if may_be_solid[triangle.material as usize] {
                let organ = &canopy.organs[triangle.organ as usize];
                let plant = plants.entry((&organ.species, &organ.plant)).or_default();
                plant.push(number as u32);
            }
        }
        for triangles in plants.values() {
            solids.add_plant(canopy, triangles);
        }
        solids.inside_out.sort_unstable();
        solids
    }

    /// Finds the solids of a plant.
    fn add_plant(&mut self, canopy: &Canopy, triangles: &[u32]) {
        let Surface {
            facets,
            points,
            twins,
        } = surface(canopy, triangles);
        let mut parts = Joined::new(points.len());
        for facet in &facets {
            parts.join(facet.corners[0], facet.corners[1]);
            parts.join(facet.corners[0], facet.corners[2]);
        }
        let edges = edges(&facets);
        let rims = rims(&edges, &points, &mut parts);
        let mut open_m2 = vec![0.0; points.len()];
        for (k, rim) in rims.iter().enumerate() {
            let Some(other) = on_it(&rims, k) else {
                open_m2[parts.of(rim.component) as usize] += rim.area_m2;
                continue;
            };
            // of two rims on one another, what the smaller one does not cover is open
            let left_m2 = 0.5 * (rim.area_m2 - other.area_m2).abs();
            open_m2[parts.of(rim.component) as usize] += left_m2;
            parts.join(rim.component, other.component);
        }
        let (mut surface_m2, mut hole_m2) = (vec![0.0; points.len()], vec![0.0; points.len()]);
        for (point, open) in open_m2.iter().enumerate() {
            hole_m2[parts.of(point as u32) as usize] += open;
        }
        for facet in &facets {
            let part = parts.of(facet.corners[0]) as usize;
            surface_m2[part] += area(&corners(facet, &points));
        }
        let encloses =
            |part: usize| hole_m2[part] <= OPEN_AT_MOST * (surface_m2[part] + hole_m2[part]);
        let outwards = outwards(&facets, &edges, &points);
        for (facet, outwards) in facets.iter().zip(outwards) {
            if !encloses(parts.of(facet.corners[0]) as usize) {
                continue;
            }
            if outwards {
                self.solid[facet.triangle as usize] = true;
            } else {
                self.inside_out.push(facet.triangle);
            }
        }
        for (twin, first, same) in twins {
            let solid = self.solid[first as usize];
            // one that is turned over is no outside
            self.solid[twin as usize] = solid && same;
        }
    }
}

fn corners(facet: &Facet, points: &[DVec3]) -> [DVec3; 3] {
    facet.corners.map(|corner| points[corner as usize])
}

fn surface(canopy: &Canopy, triangles: &[u32]) -> Surface {
    let mut numbers: HashMap<Vertex, u32> = HashMap::new();
    let mut known: HashMap<[u32; 3], usize> = HashMap::new();
    let Surface {
        mut facets,
        mut points,
        mut twins,
    } = Surface::default();
    for &triangle in triangles {
        let corners_m = canopy.triangle(triangle as usize).corners_m;
        let corners = corners_m.map(|p| {
            // -0 is 0
            let key = (p + DVec3::ZERO).to_array().map(f64::to_bits);
            *numbers.entry(key).or_insert_with(|| {
                points.push(p);
                points.len() as u32 - 1
            })
        });
        let mut sorted = corners;
        sorted.sort_unstable();
        if sorted[0] == sorted[1] || sorted[1] == sorted[2] {
            continue;
        }
        match known.get(&sorted) {
            Some(&first) => {
                let first: &Facet = &facets[first];
                let turned =
                    |k: usize| [corners[k % 3], corners[(k + 1) % 3], corners[(k + 2) % 3]];
                let same = (0..3).any(|k| turned(k) == first.corners);
                twins.push((triangle, first.triangle, same));
            }
            None => {
                known.insert(sorted, facets.len());
                facets.push(Facet { triangle, corners });
            }
        }
    }
    Surface {
        facets,
        points,
        twins,
    }
}

/// An edge, its lower end first, with the facets at it and whether each runs along it from the lower end.
type Edges = Vec<([u32; 2], Vec<(u32, bool)>)>;

fn edges(facets: &[Facet]) -> Edges {
    let mut all: Vec<([u32; 2], (u32, bool))> = Vec::with_capacity(3 * facets.len());
    for (number, facet) in (0..).zip(facets) {
        for k in 0..3 {
            let (a, b) = (facet.corners[k], facet.corners[(k + 1) % 3]);
            all.push(([a.min(b), a.max(b)], (number, a < b)));
        }
    }
    all.sort_unstable();
    let of_one = all.chunk_by(|a, b| a.0 == b.0);
    of_one
        .map(|edge| (edge[0].0, edge.iter().map(|(_, facet)| *facet).collect()))
        .collect()
}

/// The rims of edges that an odd number of facets have.
fn rims(edges: &Edges, points: &[DVec3], parts: &mut Joined) -> Vec<Rim> {
    let open: Vec<[u32; 2]> = edges
        .iter()
        .filter(|(_, facets)| facets.len() % 2 == 1)
        .map(|(ends, _)| *ends)
        .collect();
    let mut together = Joined::new(points.len());
    for &[a, b] in &open {
        together.join(a, b);
    }
    let mut next: HashMap<u32, Vec<u32>> = HashMap::new();
    for &[a, b] in &open {
        next.entry(a).or_default().push(b);
        next.entry(b).or_default().push(a);
    }
    let mut starts: Vec<u32> = open.iter().map(|&[a, _]| together.of(a)).collect();
    starts.sort_unstable();
    starts.dedup();
    let rim = |start: u32| {
        // once around; where rims touch in a point, one after the other
        let (mut around, mut at) = (vec![start], start);
        while let Some(to) = next.get_mut(&at).and_then(Vec::pop) {
            if let Some(back) = next.get_mut(&to)
                && let Some(place) = back.iter().position(|&p| p == at)
            {
                back.swap_remove(place);
            }
            around.push(to);
            at = to;
        }
        let n = around.len() as f64;
        let centre = around.iter().map(|&p| points[p as usize]).sum::<DVec3>() / n;
        let ring = around.windows(2).map(|pair| {
            let [a, b] = [pair[0], pair[1]].map(|p| points[p as usize] - centre);
            0.5 * a.cross(b)
        });
        Rim {
            centre,
            area_m2: ring.sum::<DVec3>().length(),
            component: parts.of(start),
        }
    };
    let mut rims: Vec<Rim> = starts.into_iter().map(rim).collect();
    rims.sort_by(|a, b| a.centre.x.total_cmp(&b.centre.x));
    rims
}

/// A rim that lies on rim `k`; rims are sorted by x.
fn on_it(rims: &[Rim], k: usize) -> Option<&Rim> {
    let rim = &rims[k];
    let radius = |rim: &Rim| (rim.area_m2 / std::f64::consts::PI).sqrt();
    let own = radius(rim);
    let meets = |other: &&Rim| {
        let other_m = radius(other);
        let (small, large) = (own.min(other_m), own.max(other_m));
        RIMS_ALIKE * small >= large && rim.centre.distance(other.centre) <= RIMS_MEET * large
    };
    let near = |other: &&Rim| (other.centre.x - rim.centre.x).abs() <= RIMS_MEET * RIMS_ALIKE * own;
    let after = rims[k + 1..].iter().take_while(near);
    let before = rims[..k].iter().rev().take_while(near);
    after.chain(before).find(meets)
}

/// Whether the upper face of each facet looks outwards, as far as it hangs together with others by edges of two.
fn outwards(facets: &[Facet], edges: &Edges, points: &[DVec3]) -> Vec<bool> {
    let mut beside: Vec<Vec<(u32, bool)>> = vec![Vec::new(); facets.len()];
    for (_, at) in edges {
        if let &[(a, along_a), (b, along_b)] = &at[..] {
            // neighbours that look the same way run along their edge in opposite ways
            let alike = along_a != along_b;
            beside[a as usize].push((b, alike));
            beside[b as usize].push((a, alike));
        }
    }
    let mut turned: Vec<Option<bool>> = vec![None; facets.len()];
    let mut outwards = vec![true; facets.len()];
    for start in 0..facets.len() {
        if turned[start].is_some() {
            continue;
        }
        let (mut all, mut stack) = (Vec::new(), vec![(start, false)]);
        turned[start] = Some(false);
        while let Some((k, is_turned)) = stack.pop() {
            all.push(k);
            for &(other, alike) in &beside[k] {
                let other = other as usize;
                if turned[other].is_none() {
                    turned[other] = Some(is_turned == alike);
                    stack.push((other, is_turned == alike));
                }
            }
        }
        // what looks away from its own middle encloses a positive volume
        let vertices = all.iter().flat_map(|&k| corners(&facets[k], points));
        let middle = vertices.sum::<DVec3>() / (3.0 * all.len() as f64);
        let volume = |&k: &usize| {
            let triangle = corners(&facets[k], points);
            let of_it = (triangle[0] - middle).dot(doubled_area_vector(&triangle));
            if turned[k] == Some(true) {
                -of_it
            } else {
                of_it
            }
        };
        let volume: f64 = all.iter().map(volume).sum();
        for k in all {
            outwards[k] = (turned[k] == Some(true)) != (volume >= 0.0);
        }
    }
    outwards
}

/// Numbers that are joined into sets, each known by one of them.
struct Joined(Vec<u32>);

impl Joined {
    fn new(n: usize) -> Self {
        Self((0..n as u32).collect())
    }

    fn of(&mut self, k: u32) -> u32 {
        let mut root = k;
        while self.0[root as usize] != root {
            self.0[root as usize] = self.0[self.0[root as usize] as usize];
            root = self.0[root as usize];
        }
        root
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.of(a), self.of(b));
        let (low, high) = (a.min(b), a.max(b));
        self.0[high as usize] = low;
    }
}
