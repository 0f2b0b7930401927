//! Solids that move while a shutter is open: every number of their description goes evenly from one value to the other,
//! so points move on straight lines, as vertices do ([`crate::MovingTriangles`]).

use glam::DVec3;

use super::Solid;

/// The solid at a time from 0 to 1; the first one where the two are of different kinds.
pub(super) fn between(open: &Solid, close: &Solid, time: f64) -> Solid {
    let point = |a: DVec3, b: DVec3| a + (b - a) * time;
    let number = |a: f64, b: f64| a + (b - a) * time;
    let pair =
        |a: &[Solid; 2], b: &[Solid; 2]| Box::new([0, 1].map(|side| between(&a[side], &b[side], time)));
    match (open, close) {
        (Solid::Sphere { center: a, radius: r }, Solid::Sphere { center: b, radius: s }) => Solid::Sphere {
            center: point(*a, *b),
            radius: number(*r, *s),
        },
        (
            Solid::Cylinder {
                from: a,
                to: b,
                radius: r,
            },
            Solid::Cylinder {
                from: c,
                to: d,
                radius: s,
            },
        ) => Solid::Cylinder {
            from: point(*a, *c),
            to: point(*b, *d),
            radius: number(*r, *s),
        },
        (
            Solid::Capsule {
                from: a,
                to: b,
                radius: r,
            },
            Solid::Capsule {
                from: c,
                to: d,
                radius: s,
            },
        ) => Solid::Capsule {
            from: point(*a, *c),
            to: point(*b, *d),
            radius: number(*r, *s),
        },
        (Solid::Box { center: a, half: u }, Solid::Box { center: b, half: v }) => Solid::Box {
            center: point(*a, *b),
            half: [0, 1, 2].map(|axis| point(u[axis], v[axis])),
        },
        (Solid::Union(a), Solid::Union(b)) => Solid::Union(pair(a, b)),
        (Solid::Intersection(a), Solid::Intersection(b)) => Solid::Intersection(pair(a, b)),
        (Solid::Difference(a), Solid::Difference(b)) => Solid::Difference(pair(a, b)),
        _ => open.clone(),
    }
}

/// The box around a solid at all times; `None` if it is nothing at any. Sides of a leaf's box go evenly from one place
/// to the other, or stay within.
pub(super) fn bounds_between(open: &Solid, close: &Solid) -> Option<[DVec3; 2]> {
    let around = |a: Option<[DVec3; 2]>, b: Option<[DVec3; 2]>| match (a, b) {
        (Some(a), Some(b)) => Some([a[0].min(b[0]), a[1].max(b[1])]),
        (a, b) => a.or(b),
    };
    match (open, close) {
        (Solid::Union(a), Solid::Union(b)) => {
            around(bounds_between(&a[0], &b[0]), bounds_between(&a[1], &b[1]))
        }
        (Solid::Intersection(a), Solid::Intersection(b)) => {
            let (a, b) = (bounds_between(&a[0], &b[0])?, bounds_between(&a[1], &b[1])?);
            let (low, high) = (a[0].max(b[0]), a[1].min(b[1]));
            low.cmplt(high).all().then_some([low, high])
        }
        (Solid::Difference(a), Solid::Difference(b)) => bounds_between(&a[0], &b[0]),
        _ => around(open.bounds(), close.bounds()),
    }
}
