//! Animations (glTF 2.0 §3.11): keys of translations, rotations, scales and morph weights.

use glam::{Quat, Vec3};
use gltf::json;
use gltf::json::accessor::Type;
use gltf::json::animation::{Interpolation as FileInterpolation, Property};

use super::accessor::Elements;
use super::node::Tree;
use super::source::Source;
use super::{MAX_VERTICES, Notices, place};
use crate::{Animation, Channel, ChannelTarget, Error, Interpolation, Mesh, Transform};

/// Reads all animations. Channels of nodes outside of the scene are left out.
pub(super) fn read(
    source: &Source<'_>,
    tree: &mut Tree,
    meshes: &[Mesh],
    notices: &mut Notices,
) -> Result<Vec<Animation>, Error> {
    let mut animations = Vec::new();
    let mut values = 0_u64;
    for (i, animation) in source.root.animations.iter().enumerate() {
        let place = place("animation", i, animation.name.as_ref());
        let mut channels = Vec::new();
        for (c, channel) in animation.channels.iter().enumerate() {
            let place = format!("{place}, channel {c}");
            // Channels may share accessors, so memory is not bounded by the file's size.
            values = values.saturating_add(value_count(source, animation, channel));
            if values > MAX_VERTICES as u64 {
                let what = format!("the count of {values} key values up to here");
                return Err(source.too_large(place, what, MAX_VERTICES.to_string()));
            }
            channels.extend(read_channel(
                source, tree, meshes, notices, animation, channel, &place,
            )?);
        }
        animations.push(Animation {
            name: animation.name.clone().unwrap_or_default(),
            channels,
        });
    }
    Ok(animations)
}

/// Times and values that a channel refers to.
fn value_count(source: &Source<'_>, animation: &json::Animation, channel: &json::animation::Channel) -> u64 {
    let Some(sampler) = animation.samplers.get(channel.sampler.value()) else {
        return 0;
    };
    let count = |accessor: json::Index<json::Accessor>| source.root.get(accessor).map_or(0, |a| a.count.0);
    count(sampler.input).saturating_add(count(sampler.output))
}

fn read_channel(
    source: &Source<'_>,
    tree: &mut Tree,
    meshes: &[Mesh],
    notices: &mut Notices,
    animation: &json::Animation,
    channel: &json::animation::Channel,
    place: &str,
) -> Result<Option<Channel>, Error> {
    let sampler = source.index(channel.sampler, animation.samplers.len(), "sampler", place)?;
    let sampler = &animation.samplers[sampler];
    let target = source.index(channel.target.node, source.root.nodes.len(), "node", place)?;
    let property = source.valid(&channel.target.path, "path", place)?;
    let interpolation = match source.valid(&sampler.interpolation, "interpolation", place)? {
        FileInterpolation::Step => Interpolation::Step,
        FileInterpolation::Linear => Interpolation::Linear,
        FileInterpolation::CubicSpline => Interpolation::CubicSpline,
    };
    let times = read_times(source, sampler, place)?;
    let Some(node) = tree.index[target] else {
        notices.say(place, "animations of nodes outside of the scene are left out");
        return Ok(None);
    };
    let keys = times.len()
        * if interpolation == Interpolation::CubicSpline {
            3
        } else {
            1
        };
    let output = |shape: Type, per_key: usize| -> Result<Elements<'_>, Error> {
        let elements = source.elements(sampler.output, &[shape], place)?;
        if Some(elements.count) == keys.checked_mul(per_key) {
            return Ok(elements);
        }
        let (count, times) = (elements.count, times.len());
        let problem =
            format!("{count} output values for {times} keys ({interpolation:?}, {per_key} a value)");
        Err(source.malformed(elements.place, problem))
    };
    let target = match property {
        Property::Translation => {
            ChannelTarget::Translation(output(Type::Vec3, 1)?.gather(None, Vec3::from_array))
        }
        Property::Scale => ChannelTarget::Scale(output(Type::Vec3, 1)?.gather(None, Vec3::from_array)),
        Property::Rotation => {
            let mut values = output(Type::Vec4, 1)?.gather(None, Quat::from_array);
            normalize(&mut values, interpolation);
            ChannelTarget::Rotation(values)
        }
        Property::MorphTargetWeights => {
            let targets = tree.nodes[node].mesh.map_or(0, |mesh| meshes[mesh].weights.len());
            if targets == 0 {
                let why = match tree.instanced[target] {
                    true => "morph weights of instanced meshes are not animated",
                    false => "morph weights of a node without morph targets are left out",
                };
                notices.say(place, why);
                return Ok(None);
            }
            let values = output(Type::Scalar, targets)?.gather(None, |[weight]: [f32; 1]| weight);
            ChannelTarget::Weights { targets, values }
        }
    };
    if let (Transform::Matrix(matrix), false) = (
        tree.nodes[node].transform,
        matches!(target, ChannelTarget::Weights { .. }),
    ) {
        notices.say(
            place,
            "the matrix of an animated node is taken apart into translation, rotation and scale",
        );
        let (scale, rotation, translation) = matrix.to_scale_rotation_translation();
        let rotation = if rotation.is_finite() {
            rotation.normalize()
        } else {
            glam::DQuat::IDENTITY
        };
        tree.nodes[node].transform = Transform::Trs {
            translation,
            rotation,
            scale,
        };
    }
    Ok(Some(Channel {
        node,
        times,
        interpolation,
        target,
    }))
}

/// Key times: at least one, finite, strictly increasing.
fn read_times(
    source: &Source<'_>,
    sampler: &json::animation::Sampler,
    place: &str,
) -> Result<Vec<f32>, Error> {
    let elements = source.elements(sampler.input, &[Type::Scalar], place)?;
    let times = elements.gather(None, |[time]: [f32; 1]| time);
    if times.is_empty() {
        return Err(source.malformed(elements.place, "there are no key times"));
    }
    if let Some(k) = times.iter().position(|time| !time.is_finite()) {
        return Err(source.malformed(elements.place, format!("key time {k} is not finite")));
    }
    match times.array_windows::<2>().position(|[a, b]| a >= b) {
        None => Ok(times),
        Some(k) => {
            let problem = format!(
                "key times do not increase: {} at {k}, then {}",
                times[k],
                times[k + 1]
            );
            Err(source.malformed(elements.place, problem))
        }
    }
}

/// Makes rotations unit quaternions; the tangents of splines are not rotations and stay.
fn normalize(values: &mut [Quat], interpolation: Interpolation) {
    let (start, step) = if interpolation == Interpolation::CubicSpline {
        (1, 3)
    } else {
        (0, 1)
    };
    for value in values.iter_mut().skip(start).step_by(step) {
        let sound = value.length_squared() > 0.0 && value.length_squared().is_finite();
        *value = if sound { value.normalize() } else { Quat::IDENTITY };
    }
}
