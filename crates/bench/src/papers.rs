//! Figures that the papers print, for the columns beside ours.
//!
//! HM08: one core of a 2.66 GHz Xeon X5355 (2006), 1920 x 1200, everything rebuilt in every frame. Its million rays a second
//! count eye and shadow rays of every pixel.

/// A row of HM08's Table 1.
pub(crate) struct Table1 {
    /// Its name in the paper.
    pub(crate) name: &'static str,
    /// Thousand triangles.
    pub(crate) ktriangles: u32,
    /// Our stand-in, and the real mesh where there is one in the scenes folder.
    pub(crate) builtin: &'static str,
    pub(crate) mesh: Option<&'static str>,
    /// Frames a second, share of the build, million rays a second; eye, hard, soft.
    pub(crate) kinds: [[f64; 3]; 3],
}

const fn row(
    name: &'static str,
    ktriangles: u32,
    builtin: &'static str,
    mesh: Option<&'static str>,
    kinds: [[f64; 3]; 3],
) -> Table1 {
    Table1 {
        name,
        ktriangles,
        builtin,
        mesh,
        kinds,
    }
}

/// HM08, Table 1, one core.
pub(crate) const TABLE_1: [Table1; 9] = [
    row(
        "Courtyard",
        31,
        "courtyard",
        None,
        [[30.0, 0.05, 68.0], [8.0, 0.10, 36.0], [0.26, 0.0, 5.3]],
    ),
    row(
        "FairyForest",
        174,
        "forest",
        Some("forest174k"),
        [[17.0, 0.17, 39.0], [6.0, 0.33, 27.0], [0.11, 0.01, 2.3]],
    ),
    row(
        "Bunny-69k",
        69,
        "blob-69k",
        Some("bunny69k"),
        [[44.0, 0.18, 100.0], [11.0, 0.27, 50.0], [0.41, 0.01, 8.4]],
    ),
    row(
        "Bunny-16k",
        16,
        "blob-16k",
        Some("bunny16k"),
        [[81.0, 0.07, 185.0], [24.0, 0.21, 109.0], [0.57, 0.0, 11.7]],
    ),
    row(
        "Bunny-4k",
        4,
        "blob-4k",
        Some("bunny4k"),
        [[120.0, 0.03, 274.0], [31.0, 0.13, 141.0], [0.65, 0.0, 13.3]],
    ),
    row(
        "Bunny-1k",
        1,
        "blob-1k",
        Some("bunny1k"),
        [[154.0, 0.01, 351.0], [37.0, 0.10, 169.0], [0.72, 0.0, 14.8]],
    ),
    row(
        "Dragon-Bunny",
        252,
        "collide",
        Some("dragon_bunny252k"),
        [[17.0, 0.25, 39.0], [4.0, 0.50, 18.0], [0.30, 0.04, 6.2]],
    ),
    row(
        "Conference",
        282,
        "conference",
        Some("conference331k"),
        [[16.0, 0.33, 36.0], [5.0, 0.45, 23.0], [0.19, 0.01, 3.9]],
    ),
    row(
        "ERW6",
        1,
        "office",
        None,
        [[56.0, 0.01, 128.0], [15.0, 0.03, 68.0], [0.19, 0.0, 3.9]],
    ),
];

/// Frames a second of HM08's Tables 2 and 3 at 1024 x 1024: its own, the regular grid's, the hierarchy's; `None` where
/// the paper has none.
pub(crate) struct Table23 {
    pub(crate) name: &'static str,
    pub(crate) builtin: &'static str,
    pub(crate) hard: bool,
    pub(crate) ours: f64,
    pub(crate) grid: Option<f64>,
    /// Rebuilt or refitted in every frame (Table 2), and prebuilt (Table 3).
    pub(crate) bvh: [Option<f64>; 2],
}

const fn pair(
    name: &'static str,
    builtin: &'static str,
    hard: bool,
    ours: f64,
    grid: Option<f64>,
    bvh: [Option<f64>; 2],
) -> Table23 {
    Table23 {
        name,
        builtin,
        hard,
        ours,
        grid,
        bvh,
    }
}

/// HM08, Tables 2 and 3.
pub(crate) const TABLES_2_3: [Table23; 6] = [
    pair(
        "ERW6",
        "office",
        false,
        106.0,
        Some(21.0),
        [Some(64.0), Some(49.0)],
    ),
    pair(
        "FairyForest",
        "forest",
        false,
        26.0,
        None,
        [Some(9.2), Some(12.0)],
    ),
    pair(
        "Conference",
        "conference",
        false,
        22.0,
        Some(4.8),
        [Some(16.0), Some(14.0)],
    ),
    pair("ERW6", "office", true, 36.0, None, [Some(23.0), None]),
    pair("FairyForest", "forest", true, 7.6, Some(3.4), [Some(3.2), None]),
    pair("Conference", "conference", true, 6.8, None, [Some(7.2), None]),
];

/// HM08, Table 4, of the bunny with 69.5k triangles: million triangles a second with a twentieth of the window covered,
/// and million vertices a second out of sight.
pub(crate) const TABLE_4: [f64; 2] = [8.32, 32.1];

/// HM08, Table 5: cells a ray of a regular grid of 54 x 54 x 54 and of a perspective one of 200 x 200 x 4.
pub(crate) const TABLE_5: [f64; 2] = [52.0, 12.7];
