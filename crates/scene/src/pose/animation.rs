//! Local transforms and morph weights at a time: glTF 2.0 §3.11 and appendix C.
//!
//! Before the first key and after the last one a channel holds that key's value. Rotations are interpolated
//! along the shorter arc. With cubic splines the stored tangents are per second and are scaled by the time
//! between the two keys.

use glam::{DQuat, DVec3, Quat, Vec3};

use crate::{Animation, Channel, ChannelTarget, Interpolation, Scene, Transform};

/// The animated properties of every node, before they are chained.
pub(super) struct LocalPose {
    /// Local transform of each node.
    pub(super) transforms: Vec<Transform>,
    /// Morph weights of each node's mesh; empty without morph targets.
    pub(super) weights: Vec<Vec<f32>>,
}

impl LocalPose {
    /// The pose of the file itself.
    pub(super) fn rest(scene: &Scene) -> Self {
        let weights = scene.nodes.iter().map(|node| match node.mesh {
            Some(mesh) if node.weights.is_empty() => scene.meshes[mesh].weights.clone(),
            _ => node.weights.clone(),
        });
        Self {
            transforms: scene.nodes.iter().map(|n| n.transform).collect(),
            weights: weights.collect(),
        }
    }

    /// Replaces what the animation drives by its values at `time`.
    pub(super) fn play(&mut self, animation: &Animation, time: f32) {
        for channel in &animation.channels {
            let span = Span::find(&channel.times, time);
            if let ChannelTarget::Weights { targets, values } = &channel.target {
                self.weights[channel.node] = span.weights(channel.interpolation, values, *targets);
                continue;
            }
            let (mut scale, mut rotation, mut translation) = match self.transforms[channel.node] {
                Transform::Trs {
                    translation,
                    rotation,
                    scale,
                } => (scale, rotation, translation),
                Transform::Matrix(matrix) => matrix.to_scale_rotation_translation(),
            };
            match &channel.target {
                ChannelTarget::Translation(values) => translation = span.vector(channel, values),
                ChannelTarget::Scale(values) => scale = span.vector(channel, values),
                ChannelTarget::Rotation(values) => rotation = span.rotation(channel, values),
                ChannelTarget::Weights { .. } => {}
            }
            self.transforms[channel.node] = Transform::Trs {
                translation,
                rotation,
                scale,
            };
        }
    }
}

/// Where a time falls between two keys.
struct Span {
    /// The key at or before the time.
    key: usize,
    /// The key after it; the same key outside of the keyed interval.
    next: usize,
    /// Position between the two, 0 to 1.
    s: f64,
    /// Time between the two, seconds.
    duration: f64,
}

impl Span {
    fn find(times: &[f32], time: f32) -> Self {
        let after = times.partition_point(|&t| t <= time);
        if after == 0 || after == times.len() {
            let key = after.saturating_sub(1);
            return Self {
                key,
                next: key,
                s: 0.0,
                duration: 0.0,
            };
        }
        let (start, end) = (f64::from(times[after - 1]), f64::from(times[after]));
        let duration = end - start;
        Self {
            key: after - 1,
            next: after,
            s: (f64::from(time) - start) / duration,
            duration,
        }
    }

    fn vector(&self, channel: &Channel, values: &[Vec3]) -> DVec3 {
        let value = |i: usize| values[i].as_dvec3();
        match channel.interpolation {
            Interpolation::Step => value(self.key),
            Interpolation::Linear => value(self.key).lerp(value(self.next), self.s),
            Interpolation::CubicSpline => {
                let h = self.hermite();
                self.spline_keys()
                    .into_iter()
                    .zip(h)
                    .map(|(i, h)| value(i) * h)
                    .sum()
            }
        }
    }

    fn rotation(&self, channel: &Channel, values: &[Quat]) -> DQuat {
        let value = |i: usize| values[i].as_dquat();
        let q = match channel.interpolation {
            Interpolation::Step => value(self.key),
            Interpolation::Linear => slerp(value(self.key).normalize(), value(self.next).normalize(), self.s),
            Interpolation::CubicSpline => {
                let keys = self.spline_keys().into_iter().zip(self.hermite());
                keys.fold(DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0), |sum, (i, h)| {
                    sum + value(i) * h
                })
            }
        };
        // A spline may pass through zero; no rotation is then as good as any other.
        if q.length_squared() > 0.0 && q.is_finite() {
            q.normalize()
        } else {
            DQuat::IDENTITY
        }
    }

    fn weights(&self, interpolation: Interpolation, values: &[f32], targets: usize) -> Vec<f32> {
        let value = |key: usize, target: usize| f64::from(values[key * targets + target]);
        let at = |target| match interpolation {
            Interpolation::Step => value(self.key, target),
            Interpolation::Linear => {
                let (a, b) = (value(self.key, target), value(self.next, target));
                a + (b - a) * self.s
            }
            Interpolation::CubicSpline => {
                let keys = self.spline_keys().into_iter().zip(self.hermite());
                keys.map(|(key, h)| value(key, target) * h).sum()
            }
        };
        (0..targets).map(|target| at(target) as f32).collect()
    }

    /// Positions of value, out-tangent, next value and next in-tangent among a spline's triples.
    fn spline_keys(&self) -> [usize; 4] {
        [
            3 * self.key + 1,
            3 * self.key + 2,
            3 * self.next + 1,
            3 * self.next,
        ]
    }

    /// Hermite factors in the order of [`Span::spline_keys`].
    fn hermite(&self) -> [f64; 4] {
        let (s, s2, s3) = (self.s, self.s * self.s, self.s * self.s * self.s);
        [
            2.0 * s3 - 3.0 * s2 + 1.0,
            self.duration * (s3 - 2.0 * s2 + s),
            -2.0 * s3 + 3.0 * s2,
            self.duration * (s3 - s2),
        ]
    }
}

/// Spherical interpolation of unit quaternions along the shorter arc. Not glam's, whose arc cosine is
/// approximate to 7e-5.
fn slerp(a: DQuat, b: DQuat, s: f64) -> DQuat {
    let b = if a.dot(b) < 0.0 { -b } else { b };
    let angle = 2.0 * (a - b).length().atan2((a + b).length());
    let sine = angle.sin();
    if sine < 1e-12 {
        return a * (1.0 - s) + b * s;
    }
    a * (((1.0 - s) * angle).sin() / sine) + b * ((s * angle).sin() / sine)
}
