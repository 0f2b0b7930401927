//! A skinned humanoid, 1.75 m tall, and its walk.
//!
//! The body is made of closed parts (head, torso, limbs, shoes) that overlap at the joints; one skin of 19 joints
//! moves them. A vertex follows the bones of its part, weighted by the inverse fourth power of the distance, so
//! that bends are smooth. The walk solves each leg for a given path of the ankle: a foot on the ground moves
//! straight back at constant speed. Figures stand on y = 0 and look along +Z; their left is +X.

use std::f32::consts::{PI, TAU};

use glam::{EulerRot, Mat4, Quat, Vec3, Vec4, vec3};

use super::shapes::{Ends, Surface, disc_loop, geosphere, loft};
use super::stage::{Stage, sampled};
use crate::{Node, Primitive, Skin, Transform};

/// A figure's nodes.
pub(super) struct Figure {
    /// The node that places the whole figure.
    pub(super) root: usize,
    joints: [usize; JOINTS.len()],
}

/// Materials of a figure.
#[derive(Clone, Copy)]
pub(super) struct Clothes {
    pub(super) skin: usize,
    pub(super) hair: usize,
    pub(super) shirt: usize,
    pub(super) trousers: usize,
    pub(super) shoes: usize,
}

/// Metres that a walking figure moves on in one cycle.
pub(super) const STRIDE: f32 = 2.0 * REACH / STANCE;

/// Furthest distance of an ankle before and behind the hip.
const REACH: f32 = 0.33;
/// Share of the cycle that a foot is on the ground.
const STANCE: f32 = 0.6;
/// Length of thigh and of shin.
const BONE: f32 = 0.42;
const ANKLE: f32 = 0.08;

const HIPS: usize = 0;
const SPINE: usize = 1;
const CHEST: usize = 2;
const NECK: usize = 3;
const HEAD: usize = 4;
const UPPER_ARM: usize = 5;
const FOREARM: usize = 6;
const HAND: usize = 7;
const THIGH: usize = 8;
const SHIN: usize = 9;
const FOOT: usize = 10;
const TOES: usize = 11;
/// From a joint of the left to the same joint of the right.
const RIGHT: usize = 7;

/// Name, parent and rest position of each joint; the rest pose has no rotations.
const JOINTS: [(&str, usize, Vec3); 19] = [
    ("hips", HIPS, vec3(0.0, 0.96, 0.0)),
    ("spine", HIPS, vec3(0.0, 1.08, 0.0)),
    ("chest", SPINE, vec3(0.0, 1.26, 0.0)),
    ("neck", CHEST, vec3(0.0, 1.47, -0.01)),
    ("head", NECK, vec3(0.0, 1.56, 0.0)),
    ("left upper arm", CHEST, vec3(0.185, 1.405, 0.0)),
    ("left forearm", UPPER_ARM, vec3(0.235, 1.13, 0.0)),
    ("left hand", FOREARM, vec3(0.27, 0.88, 0.01)),
    ("left thigh", HIPS, vec3(0.092, 0.92, 0.0)),
    ("left shin", THIGH, vec3(0.092, 0.50, 0.0)),
    ("left foot", SHIN, vec3(0.092, ANKLE, 0.0)),
    ("left toes", FOOT, vec3(0.092, 0.03, 0.13)),
    ("right upper arm", CHEST, vec3(-0.185, 1.405, 0.0)),
    ("right forearm", UPPER_ARM + RIGHT, vec3(-0.235, 1.13, 0.0)),
    ("right hand", FOREARM + RIGHT, vec3(-0.27, 0.88, 0.01)),
    ("right thigh", HIPS, vec3(-0.092, 0.92, 0.0)),
    ("right shin", THIGH + RIGHT, vec3(-0.092, 0.50, 0.0)),
    ("right foot", SHIN + RIGHT, vec3(-0.092, ANKLE, 0.0)),
    ("right toes", FOOT + RIGHT, vec3(-0.092, 0.03, 0.13)),
];

/// Adds a figure in its rest pose, arms hanging.
pub(super) fn figure(stage: &mut Stage, name: &str, clothes: Clothes, at: Transform) -> Figure {
    let root = stage.node(Node {
        name: name.into(),
        transform: at,
        ..Node::default()
    });
    let mut joints = [root; JOINTS.len()];
    for (i, &(joint, parent, position)) in JOINTS.iter().enumerate() {
        let (parent, base) = if i == HIPS {
            (root, Vec3::ZERO)
        } else {
            (joints[parent], JOINTS[parent].2)
        };
        joints[i] = stage.place_joint(joint, parent, position - base);
    }
    let inverse_bind = JOINTS.iter().map(|j| Mat4::from_translation(-j.2)).collect();
    stage.scene.skins.push(Skin {
        name: name.into(),
        joints: joints.to_vec(),
        inverse_bind,
    });
    let skin = Some(stage.scene.skins.len() - 1);
    let mesh = Some(stage.mesh(name, body(clothes)));
    stage.node(Node {
        name: format!("{name} body"),
        parent: Some(root),
        mesh,
        skin,
        ..Node::default()
    });
    Figure { root, joints }
}

impl Figure {
    /// Node of the chest, to hang things on.
    pub(super) fn chest(&self) -> usize {
        self.joints[CHEST]
    }

    /// Node of the left hand.
    pub(super) fn left_hand(&self) -> usize {
        self.joints[HAND]
    }

    /// Bends the arms forward (radians at shoulder and elbow, left then right).
    pub(super) fn bend_arms(&self, stage: &mut Stage, bends: [(f32, f32); 2]) {
        for (side, (shoulder, elbow)) in [0, RIGHT].into_iter().zip(bends) {
            for (joint, bend) in [(UPPER_ARM, shoulder), (FOREARM, elbow)] {
                if let Transform::Trs { rotation, .. } =
                    &mut stage.scene.nodes[self.joints[joint + side]].transform
                {
                    *rotation = forward(bend).as_dquat();
                }
            }
        }
    }

    /// Adds the walk to an animation: `cycles` of `period` seconds, starting at a phase in [0, 1). The figure
    /// walks on the spot; whoever moves its root by [`STRIDE`] a cycle sees no foot slide.
    pub(super) fn walk(&self, stage: &mut Stage, animation: usize, period: f32, cycles: usize, start: f32) {
        let track = |value: &dyn Fn(f32) -> Quat| {
            sampled(period * cycles as f32, 20 * cycles, |share| {
                value((share * cycles as f32 + start).fract())
            })
        };
        let (times, hips) = sampled(period * cycles as f32, 20 * cycles, |share| {
            JOINTS[HIPS].2 - Vec3::Y * sink((share * cycles as f32 + start).fract())
        });
        stage.slide(animation, self.joints[HIPS], times, hips);
        for joint in [SPINE, CHEST, HEAD, UPPER_ARM, FOREARM, THIGH, SHIN, FOOT, TOES] {
            let sides: &[usize] = if joint < UPPER_ARM { &[0] } else { &[0, RIGHT] };
            for &side in sides {
                let lag = if side == RIGHT { 0.5 } else { 0.0 };
                let (times, turns) = track(&|phase| turn(joint, (phase + lag).fract()));
                stage.turn(animation, self.joints[joint + side], times, turns);
            }
        }
    }
}

/// Rotation of a joint (of the left side) at a phase; at 0 the left heel touches the ground.
fn turn(joint: usize, phase: f32) -> Quat {
    let swing = (phase * TAU).cos();
    let (thigh, knee, foot, toes) = leg(phase);
    match joint {
        SPINE => Quat::from_euler(EulerRot::YXZ, 0.07 * swing, 0.05, 0.0),
        CHEST => Quat::from_rotation_y(0.10 * swing),
        HEAD => Quat::from_euler(EulerRot::YXZ, -0.15 * swing, -0.03, 0.0),
        UPPER_ARM => forward(-0.05 - 0.42 * swing),
        FOREARM => forward(0.32 - 0.22 * swing),
        THIGH => forward(thigh),
        SHIN => forward(-knee),
        FOOT => forward(foot),
        _ => forward(toes),
    }
}

/// Thigh forward, knee bent, foot and toes raised, radians, each relative to its parent.
fn leg(phase: f32) -> (f32, f32, f32, f32) {
    let (ahead, height, pitch) = ankle(phase);
    let drop = JOINTS[THIGH].2.y - sink(phase) - height;
    let length = (ahead * ahead + drop * drop).sqrt().min(2.0 * BONE - 0.002);
    let lean = ahead.atan2(drop);
    let half_knee = (length / (2.0 * BONE)).acos();
    let shin = lean - half_knee;
    (
        lean + half_knee,
        2.0 * half_knee,
        -pitch - shin,
        0.8 * pitch.max(0.0),
    )
}

/// How far the hips are below their height at rest; lowest when both feet are on the ground.
fn sink(phase: f32) -> f32 {
    0.047 + 0.026 * (2.0 * phase * TAU).cos()
}

/// Path of the ankle in one cycle: ahead of the hip, above the ground, and the toes' pitch below the horizontal.
fn ankle(phase: f32) -> (f32, f32, f32) {
    const LIFT: f32 = 0.09;
    const PUSH: f32 = 0.65;
    const STRIKE: f32 = 0.30;
    if phase < STANCE {
        let t = phase / STANCE;
        let heel = ease((t - 0.6) / 0.4);
        (
            REACH * (1.0 - 2.0 * t),
            ANKLE + LIFT * heel,
            PUSH * heel - STRIKE * (1.0 - ease(t / 0.2)),
        )
    } else {
        let t = (phase - STANCE) / (1.0 - STANCE);
        let height = ANKLE + LIFT * (1.0 - ease(t)) + 0.06 * (t * PI).sin();
        (
            REACH * (2.0 * ease(t) - 1.0),
            height,
            PUSH - (PUSH + STRIKE) * ease(t * 1.2),
        )
    }
}

/// Smooth step from 0 to 1.
fn ease(t: f32) -> f32 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// A turn that brings something that hangs forward.
fn forward(angle: f32) -> Quat {
    Quat::from_rotation_x(-angle)
}

/// All parts, one primitive a material.
fn body(clothes: Clothes) -> Vec<Primitive> {
    let mut parts = vec![
        weighted(trunk(), clothes.shirt, &[HIPS, SPINE, CHEST]),
        weighted(pelvis(), clothes.trousers, &[HIPS]),
        weighted(neck(), clothes.skin, &[CHEST, NECK, HEAD]),
        weighted(head(), clothes.skin, &[HEAD]),
        weighted(hair(), clothes.hair, &[HEAD]),
        weighted(eyes(), clothes.hair, &[HEAD]),
    ];
    for side in [0, RIGHT] {
        let limb = |surface: Surface, material: usize, bones: &[usize]| {
            let mirror = vec3(if side == 0 { 1.0 } else { -1.0 }, 1.0, 1.0);
            let bones: Vec<usize> = bones
                .iter()
                .map(|&b| if b < UPPER_ARM { b } else { b + side })
                .collect();
            weighted(
                surface.moved(glam::Affine3A::from_scale(mirror)),
                material,
                &bones,
            )
        };
        parts.push(limb(sleeve(), clothes.shirt, &[CHEST, UPPER_ARM, FOREARM]));
        parts.push(limb(hand(), clothes.skin, &[FOREARM, HAND]));
        parts.push(limb(leg_part(), clothes.trousers, &[HIPS, THIGH, SHIN]));
        parts.push(limb(shoe(), clothes.shoes, &[FOOT, TOES]));
    }
    let mut primitives: Vec<Primitive> = Vec::new();
    for part in parts {
        match primitives.iter_mut().find(|p| p.material == part.material) {
            Some(whole) => append(whole, part),
            None => primitives.push(part),
        }
    }
    primitives
}

fn append(whole: &mut Primitive, part: Primitive) {
    let base = whole.positions.len() as u32;
    whole
        .triangles
        .extend(part.triangles.iter().map(|t| t.map(|i| i + base)));
    whole.positions.extend(part.positions);
    whole.normals.extend(part.normals);
    whole.joints.extend(part.joints);
    whole.weights.extend(part.weights);
}

/// A part bound to some bones (three at most).
fn weighted(surface: Surface, material: usize, bones: &[usize]) -> Primitive {
    let mut primitive = surface.into_primitive(75.0, material);
    for &p in &primitive.positions {
        let mut joints = [0; 4];
        let mut weights = Vec4::ZERO;
        for (slot, &bone) in bones.iter().enumerate() {
            joints[slot] = bone as u16;
            weights[slot] = (distance_to_bone(p, bone).powi(4) + 1e-7).recip();
        }
        primitive.joints.push(joints);
        primitive.weights.push(weights / weights.element_sum());
    }
    primitive
}

/// Distance to the segment from a joint to its child; hands, toes and head go on in their direction.
fn distance_to_bone(p: Vec3, bone: usize) -> f32 {
    let start = JOINTS[bone].2;
    let side = if bone >= UPPER_ARM + RIGHT { RIGHT } else { 0 };
    let end = match bone - side {
        HIPS => JOINTS[SPINE].2,
        HEAD => start + Vec3::Y * 0.2,
        HAND => start - Vec3::Y * 0.15,
        TOES => start + Vec3::Z * 0.1,
        _ => JOINTS[bone + 1].2,
    };
    let along = end - start;
    let share = ((p - start).dot(along) / along.length_squared()).clamp(0.0, 1.0);
    p.distance(start + along * share)
}

/// A body part from level rings of (height, half width, half depth, centre x, centre z), upwards.
fn stack(rings: &[[f32; 5]], sides: usize) -> Surface {
    let rows: Vec<_> = rings
        .iter()
        .map(|&[y, width, depth, x, z]| disc_loop(vec3(x, y, z), Vec3::X * width, Vec3::NEG_Z * depth, sides))
        .collect();
    let cap = |ring: [f32; 5], rise: f32| vec3(ring[3], ring[0] + rise, ring[4]);
    loft(
        &rows,
        Ends::Fans(cap(rings[0], -0.01), cap(rings[rings.len() - 1], 0.01)),
    )
}

fn trunk() -> Surface {
    let rings = [
        [0.93, 0.155, 0.105, 0.0, 0.0],
        [1.00, 0.158, 0.110, 0.0, 0.005],
        [1.10, 0.145, 0.102, 0.0, 0.005],
        [1.20, 0.155, 0.108, 0.0, 0.005],
        [1.31, 0.175, 0.115, 0.0, 0.0],
        [1.39, 0.192, 0.100, 0.0, -0.005],
        [1.44, 0.150, 0.080, 0.0, -0.01],
        [1.485, 0.065, 0.058, 0.0, -0.01],
    ];
    stack(&rings, 14)
}

fn pelvis() -> Surface {
    let rings = [
        [0.84, 0.120, 0.080, 0.0, 0.0],
        [0.90, 0.158, 0.108, 0.0, -0.005],
        [0.96, 0.153, 0.106, 0.0, 0.0],
    ];
    stack(&rings, 14)
}

fn neck() -> Surface {
    stack(
        &[
            [1.44, 0.056, 0.056, 0.0, -0.01],
            [1.50, 0.050, 0.052, 0.0, -0.005],
            [1.58, 0.050, 0.055, 0.0, 0.0],
        ],
        8,
    )
}

/// A head with a chin and a nose.
fn head() -> Surface {
    geosphere(3).warped(|p| {
        let jaw = 1.0 - 0.22 * ease(-p.y);
        let nose = 0.022 * (-((p - vec3(0.0, -0.15, 0.98)).length() / 0.25).powi(2)).exp();
        vec3(
            0.076 * p.x * jaw,
            1.645 + 0.118 * p.y,
            0.012 + 0.092 * p.z + 0.03 * ease(-p.y) + nose,
        )
    })
}

fn eyes() -> Surface {
    Surface::joined([-1.0, 1.0].map(|side| {
        geosphere(1).warped(|p| p * vec3(0.011, 0.008, 0.009) + vec3(side * 0.028, 1.663, 0.091))
    }))
}

fn hair() -> Surface {
    geosphere(3).warped(|p| {
        let face = ease((p.z - 0.1) / 0.5) * ease((0.55 - p.y) / 0.5);
        let size = 1.0 - 0.3 * face;
        vec3(
            0.084 * p.x * size,
            1.672 + 0.108 * p.y,
            -0.012 + 0.096 * p.z * size,
        )
    })
}

fn sleeve() -> Surface {
    let rings = [
        [0.90, 0.034, 0.034, 0.267, 0.01],
        [0.98, 0.039, 0.040, 0.256, 0.005],
        [1.08, 0.043, 0.044, 0.242, 0.0],
        [1.13, 0.044, 0.045, 0.235, 0.0],
        [1.20, 0.046, 0.048, 0.222, 0.0],
        [1.30, 0.053, 0.056, 0.200, 0.0],
        [1.375, 0.054, 0.062, 0.178, 0.0],
        [1.418, 0.036, 0.045, 0.160, 0.0],
    ];
    stack(&rings, 8)
}

fn hand() -> Surface {
    let rings = [
        [0.715, 0.012, 0.022, 0.282, 0.03],
        [0.76, 0.017, 0.036, 0.281, 0.025],
        [0.81, 0.019, 0.042, 0.278, 0.02],
        [0.86, 0.020, 0.032, 0.272, 0.012],
        [0.92, 0.025, 0.027, 0.265, 0.008],
    ];
    stack(&rings, 8)
}

fn leg_part() -> Surface {
    let rings = [
        [0.075, 0.050, 0.062, 0.092, 0.0],
        [0.16, 0.050, 0.058, 0.092, -0.005],
        [0.32, 0.058, 0.066, 0.092, -0.012],
        [0.44, 0.060, 0.062, 0.092, 0.0],
        [0.50, 0.062, 0.064, 0.092, 0.004],
        [0.56, 0.065, 0.067, 0.092, 0.002],
        [0.70, 0.076, 0.082, 0.090, 0.0],
        [0.84, 0.084, 0.098, 0.084, -0.005],
        [0.93, 0.075, 0.095, 0.075, -0.005],
    ];
    stack(&rings, 9)
}

/// Rings along Z from heel to toe, with a flat sole on y = 0.
fn shoe() -> Surface {
    let rings = [
        (-0.075, 0.030, 0.060),
        (-0.055, 0.042, 0.095),
        (0.02, 0.046, 0.100),
        (0.09, 0.050, 0.070),
        (0.15, 0.050, 0.052),
        (0.20, 0.034, 0.038),
    ];
    let rows: Vec<_> = rings
        .iter()
        .map(|&(z, width, height)| {
            let mut row = disc_loop(
                vec3(0.092, 0.35 * height, z),
                Vec3::X * width,
                Vec3::Y * height * 0.65,
                8,
            );
            row.iter_mut().for_each(|p| p.y = p.y.max(0.0));
            row
        })
        .collect();
    loft(
        &rows,
        Ends::Fans(vec3(0.092, 0.025, -0.085), vec3(0.092, 0.018, 0.215)),
    )
}
