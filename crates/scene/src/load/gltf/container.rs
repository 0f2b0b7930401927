//! The outer layers of a glTF file: GLB chunks, JSON, version and extensions (glTF 2.0 §4, §3.12).

use std::path::Path;

use gltf::json::{Root, Value};

use super::{Notices, malformed, solid};
use crate::Error;

/// Extensions whose content is read, or which change nothing that is shown.
const KNOWN_EXTENSIONS: &[&str] = &[
    "EXT_mesh_gpu_instancing",
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

/// Names of properties that hold an index.
const INDICES: &[&str] = &[
    "NORMAL",
    "POSITION",
    "TANGENT",
    "buffer",
    "bufferView",
    "camera",
    "index",
    "indices",
    "input",
    "inverseBindMatrices",
    "light",
    "material",
    "mesh",
    "node",
    "output",
    "sampler",
    "scene",
    "skeleton",
    "skin",
    "source",
];
/// Names of properties that hold a list of indices (or, at the top, of objects).
const INDEX_LISTS: &[&str] = &["children", "joints", "nodes"];

/// A parsed file whose references are not resolved yet.
pub(super) struct Container<'a> {
    pub(super) root: Root,
    /// `extras.radius` of each `KHR_lights_punctual` light, 0 where absent.
    pub(super) light_radii: Vec<f32>,
    /// The extras of each node by which it is a solid, null where absent; empty if all are.
    pub(super) solids: Vec<Value>,
    /// Content of the GLB's BIN chunk.
    pub(super) bin: Option<&'a [u8]>,
}

/// Parses a GLB or a JSON file and checks its version and required extensions.
pub(super) fn parse<'a>(path: &Path, bytes: &'a [u8], notices: &mut Notices) -> Result<Container<'a>, Error> {
    let (text, bin) = if bytes.starts_with(b"glTF") {
        split_glb(path, bytes)?
    } else if bytes.trim_ascii_start().starts_with(b"{") {
        (bytes, None)
    } else {
        let start = bytes[..bytes.len().min(4)].escape_ascii();
        let problem = format!("neither the magic \"glTF\" nor JSON, but \"{start}\"");
        return Err(malformed(path, "byte 0", problem));
    };
    let mut json: Value = serde_json::from_slice(text).map_err(|e| json_error(path, &e))?;
    check_version(path, &json)?;
    let light_radii = light_radii(&json);
    let solids = solids(&mut json);
    fit_to_model(&mut json, notices);
    let root: Root = serde_json::from_value(json).map_err(|e| {
        // Only the text knows lines; it may not show the same error, as it was fitted to the model meanwhile.
        match gltf::json::deserialize::from_slice::<Root>(text) {
            Err(in_text) if in_text.line() > 0 => json_error(path, &in_text),
            _ => malformed(path, "JSON", e.to_string()),
        }
    })?;
    check_extensions(path, &root, notices)?;
    Ok(Container {
        root,
        light_radii,
        solids,
        bin,
    })
}

fn json_error(path: &Path, error: &serde_json::Error) -> Error {
    let text = error.to_string();
    let tail = format!(" at line {} column {}", error.line(), error.column());
    let problem = text.strip_suffix(&tail).unwrap_or(&text).to_string();
    malformed(
        path,
        format!("JSON line {}, column {}", error.line(), error.column()),
        problem,
    )
}

fn read_u32(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..at + 4)?.try_into().ok().map(u32::from_le_bytes)
}

/// The JSON and BIN chunks. Unknown chunks are skipped, as the format asks; bytes after the end are ignored.
fn split_glb<'a>(path: &Path, bytes: &'a [u8]) -> Result<(&'a [u8], Option<&'a [u8]>), Error> {
    let (Some(version), Some(length)) = (read_u32(bytes, 4), read_u32(bytes, 8)) else {
        return Err(malformed(
            path,
            "byte 4",
            format!("the GLB header ends after {} of 12 bytes", bytes.len()),
        ));
    };
    if version != 2 {
        return Err(Error::Unsupported {
            path: path.into(),
            what: format!("GLB version {version}"),
        });
    }
    let length = length as usize;
    if length < 12 || length > bytes.len() {
        let problem = format!("the header says {length} bytes, the file has {}", bytes.len());
        return Err(malformed(path, "byte 8", problem));
    }
    let (mut json, mut bin) = (None, None);
    let mut at = 12;
    while at < length {
        let (Some(size), Some(kind)) = (
            read_u32(&bytes[..length], at),
            bytes[..length].get(at + 4..at + 8),
        ) else {
            return Err(malformed(
                path,
                format!("byte {at}"),
                "the file ends inside a chunk header",
            ));
        };
        let (start, size) = (at + 8, size as usize);
        let Some(chunk) = bytes[..length].get(start..start.saturating_add(size)) else {
            let rest = length - start;
            let problem = format!("the chunk says {size} bytes, {rest} are left");
            return Err(malformed(path, format!("byte {at}"), problem));
        };
        match kind {
            b"JSON" if json.is_none() => json = Some(chunk),
            _ if json.is_none() => {
                let problem = format!("the first chunk is \"{}\" instead of JSON", kind.escape_ascii());
                return Err(malformed(path, format!("byte {}", at + 4), problem));
            }
            b"BIN\0" if bin.is_none() => bin = Some(chunk),
            _ => {}
        }
        at = start + size;
    }
    json.map(|json| (json, bin))
        .ok_or_else(|| malformed(path, "byte 12", "there is no JSON chunk"))
}

/// Refuses other versions before their unlike structure leads to puzzling messages.
fn check_version(path: &Path, json: &Value) -> Result<(), Error> {
    let asset = json
        .get("asset")
        .ok_or_else(|| malformed(path, "JSON", "there is no \"asset\" object"))?;
    let version = asset.get("version").and_then(Value::as_str);
    let Some(version) = version else {
        return Err(malformed(path, "asset", "there is no \"version\" string"));
    };
    let minimum = asset.get("minVersion").and_then(Value::as_str);
    if !version.starts_with("2.") || minimum.is_some_and(|m| m != "2.0") {
        let what = format!("glTF version {}", minimum.unwrap_or(version));
        return Err(Error::Unsupported {
            path: path.into(),
            what,
        });
    }
    Ok(())
}

fn light_radii(json: &Value) -> Vec<f32> {
    let lights = json
        .pointer("/extensions/KHR_lights_punctual/lights")
        .and_then(Value::as_array);
    let radius = |light: &Value| {
        light
            .pointer("/extras/radius")
            .and_then(Value::as_f64)
            .unwrap_or(0.0) as f32
    };
    let sound = |radius: f32| if radius.is_finite() { radius.max(0.0) } else { 0.0 };
    lights
        .map(|lights| lights.iter().map(radius).map(sound).collect())
        .unwrap_or_default()
}

fn solids(json: &mut Value) -> Vec<Value> {
    let Some(nodes) = json.get_mut("nodes").and_then(Value::as_array_mut) else {
        return Vec::new();
    };
    let take = |node: &mut Value| node.get_mut("extras")?.get_mut(solid::KEY).map(Value::take);
    let solids: Vec<_> = nodes
        .iter_mut()
        .map(|node| take(node).unwrap_or_default())
        .collect();
    if solids.iter().all(Value::is_null) {
        return Vec::new();
    }
    solids
}

/// Changes what `gltf::json` cannot take though the format allows it: extras inside of extensions, scenes
/// without nodes, extended lights, and animation channels without a node (`KHR_animation_pointer`).
fn fit_to_model(json: &mut Value, notices: &mut Notices) {
    prepare(json);
    if let Some(Value::Array(scenes)) = json.get_mut("scenes") {
        for scene in scenes.iter_mut().filter_map(Value::as_object_mut) {
            scene.entry("nodes").or_insert_with(|| Value::Array(Vec::new()));
        }
    }
    if let Some(Value::Array(lights)) = json.pointer_mut("/extensions/KHR_lights_punctual/lights") {
        for light in lights.iter_mut().filter_map(Value::as_object_mut) {
            light.remove("extensions");
        }
    }
    let Some(Value::Array(animations)) = json.get_mut("animations") else {
        return;
    };
    for (i, animation) in animations.iter_mut().enumerate() {
        let Some(Value::Array(channels)) = animation.get_mut("channels") else {
            continue;
        };
        channels.retain(|channel| {
            let on_node = channel
                .get("target")
                .is_none_or(|target| target.get("node").is_some());
            if !on_node {
                notices.say(
                    format!("animation {i}"),
                    "channels that drive no node are left out",
                );
            }
            on_node
        });
    }
}

/// Removes extras, and makes the largest index (which exists nowhere) of indices above 32 bits: the model would
/// cut them down to valid ones. Recursion is bounded by the depth limit of the JSON parser (128).
fn prepare(json: &mut Value) {
    match json {
        Value::Object(map) => {
            map.remove("extras");
            for (key, value) in map {
                match value {
                    Value::Number(_) if INDICES.contains(&key.as_str()) => limit_index(value),
                    Value::Array(list) if INDEX_LISTS.contains(&key.as_str()) => {
                        list.iter_mut().for_each(limit_index);
                        list.iter_mut().for_each(prepare);
                    }
                    _ => prepare(value),
                }
            }
        }
        Value::Array(values) => values.iter_mut().for_each(prepare),
        _ => {}
    }
}

fn limit_index(value: &mut Value) {
    if value.as_u64().is_some_and(|index| index > u64::from(u32::MAX)) {
        *value = u32::MAX.into();
    }
}

fn check_extensions(path: &Path, root: &Root, notices: &mut Notices) -> Result<(), Error> {
    let unknown = |name: &&String| !KNOWN_EXTENSIONS.contains(&name.as_str());
    let missing: Vec<&str> = root
        .extensions_required
        .iter()
        .filter(unknown)
        .map(String::as_str)
        .collect();
    if !missing.is_empty() {
        return Err(Error::Unsupported {
            path: path.into(),
            what: missing.join(", "),
        });
    }
    for name in root.extensions_used.iter().filter(unknown) {
        notices.say(
            "extensionsUsed",
            format!("{name} is not supported and has no effect"),
        );
    }
    Ok(())
}
