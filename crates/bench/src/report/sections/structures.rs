//! Structures beside each other.

use crate::report::{Plot, PlotKind, Section};
use crate::structures::{BRUTE, StructuresReport};
use crate::table::{Table, number, optional};

/// A section for each scene.
pub fn structures(report: &StructuresReport) -> Vec<Section> {
    let mut sections = Vec::new();
    for scene in &report.scenes {
        let method = format!(
            "{} triangles. Rays of one thread, medians of {} runs in turns; nodes are what a structure opens on its way: \
             boxes, cells, texels. Answers are held against those of the hierarchy \"bvh\".",
            scene.triangles, report.runs
        );
        let mut section = Section::new(format!("Structures, {}", scene.scene)).text(method);
        for class in &scene.classes {
            let mut table = Table::new(&[
                "structure",
                "ns a ray",
                "nodes a ray",
                "tests a ray",
                "rays",
                "hits",
                "other answers",
            ]);
            let mut bars: Vec<(String, Vec<f64>)> = Vec::new();
            for row in &class.rows {
                // Beside brute force all others would be too short to be told apart.
                let ns = row.ns_per_ray.filter(|_| row.structure != BRUTE);
                bars.extend(ns.map(|ns| (row.structure.clone(), vec![ns])));
                table.row(vec![
                    row.structure.clone(),
                    row.ns_per_ray.map_or("OTHER ANSWERS".into(), number),
                    optional(row.nodes_per_ray),
                    optional(row.tests_per_ray),
                    row.rays.to_string(),
                    row.hits.to_string(),
                    row.differing.to_string(),
                ]);
            }
            section = section
                .table(format!("{}: {}", class.class, class.what), table)
                .plot(Plot {
                    name: format!("structures-{}-{}", scene.scene, class.class),
                    caption: format!(
                        "Nanoseconds a ray of the class \"{}\" in {}.",
                        class.class, scene.scene
                    ),
                    kind: PlotKind::Bars {
                        axis: "ns a ray".into(),
                        series: vec![scene.scene.clone()],
                        groups: bars,
                        mark: None,
                    },
                });
        }
        let mut built = Table::new(&["structure", "build ms", "bytes", "what it is"]);
        for structure in &scene.structures {
            built.row(vec![
                structure.name.clone(),
                number(structure.build_ms),
                structure.bytes.map_or("-".into(), |bytes| bytes.to_string()),
                structure.what.into(),
            ]);
        }
        sections.push(section.table("Builds", built));
    }
    sections
}
