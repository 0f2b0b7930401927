//! Builds small glTF files, sound and broken, in a temporary folder.

use std::path::PathBuf;

use rayward_scene::{Error, LoadOptions, Scene, load};
use serde_json::{Value, json};
use tempfile::TempDir;

/// Component types.
pub(super) const U8: u32 = 5121;
pub(super) const U16: u32 = 5123;
pub(super) const F32: u32 = 5126;

/// A glTF in the making.
pub(super) struct Builder {
    pub(super) json: Value,
    pub(super) bin: Vec<u8>,
    pub(super) folder: TempDir,
}

/// Little-endian bytes of floats.
pub(super) fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

impl Builder {
    /// Nothing but the version.
    pub(super) fn empty() -> Self {
        let json = json!({"asset": {"version": "2.0"}, "buffers": [], "bufferViews": [], "accessors": []});
        Self {
            json,
            bin: Vec::new(),
            folder: TempDir::new().expect("a temporary folder"),
        }
    }

    /// Node 0 "tri" shows mesh 0 "roof" with one triangle: positions are accessor 0, u16 indices accessor 1.
    pub(super) fn triangle() -> Self {
        let mut file = Self::empty();
        let positions = file.accessor(&floats(&[0., 0., 0., 1., 0., 0., 0., 1., 0.]), F32, "VEC3", 3);
        let indices = file.accessor(&[0, 0, 1, 0, 2, 0], U16, "SCALAR", 3);
        let primitive = json!({"attributes": {"POSITION": positions}, "indices": indices});
        file.json["meshes"] = json!([{"name": "roof", "primitives": [primitive]}]);
        file.json["nodes"] = json!([{"name": "tri", "mesh": 0}]);
        file.json["scenes"] = json!([{"nodes": [0]}]);
        file.json["scene"] = json!(0);
        file
    }

    /// Appends bytes as a buffer view; its index.
    pub(super) fn view(&mut self, bytes: &[u8]) -> usize {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let view = json!({"buffer": 0, "byteOffset": self.bin.len(), "byteLength": bytes.len()});
        self.bin.extend(bytes);
        push(&mut self.json["bufferViews"], view)
    }

    /// Appends an accessor over its own buffer view; its index.
    pub(super) fn accessor(&mut self, bytes: &[u8], component: u32, shape: &str, count: u64) -> usize {
        let view = self.view(bytes);
        let accessor = json!({"bufferView": view, "componentType": component, "type": shape, "count": count});
        push(&mut self.json["accessors"], accessor)
    }

    /// The primitive of the triangle.
    pub(super) fn primitive(&mut self) -> &mut Value {
        &mut self.json["meshes"][0]["primitives"][0]
    }

    /// The bytes of a GLB.
    pub(super) fn glb(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        if !self.bin.is_empty() {
            json["buffers"] = json!([{"byteLength": self.bin.len()}]);
        }
        let mut json = json.to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut bin = self.bin.clone();
        bin.resize(bin.len().next_multiple_of(4), 0);
        let length = 12 + 8 + json.len() + 8 + bin.len();
        let mut out = b"glTF\x02\0\0\0".to_vec();
        out.extend((length as u32).to_le_bytes());
        for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &bin)] {
            out.extend((chunk.len() as u32).to_le_bytes());
            out.extend(kind);
            out.extend(chunk);
        }
        out
    }

    /// Writes a file into the folder.
    pub(super) fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.folder.path().join(name);
        std::fs::write(&path, bytes).expect("a file can be written");
        path
    }

    /// What loading the GLB gives.
    pub(super) fn load(&self) -> Result<Scene, Error> {
        load(&self.write("scene.glb", self.glb()), &LoadOptions::default())
    }
}

/// Appends to a JSON array that may not exist yet; the element's index.
pub(super) fn push(list: &mut Value, element: Value) -> usize {
    if !list.is_array() {
        *list = json!([]);
    }
    let list = list.as_array_mut().expect("an array");
    list.push(element);
    list.len() - 1
}
