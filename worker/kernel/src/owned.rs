//! What a block holds of a scene, by numbers of the scene.

/// What a block holds of the scene.
#[derive(Clone, Copy, Debug)]
pub struct Owned<'a> {
    /// Numbers of its triangles in the scene, and whether rows of them are wanted; rising.
    pub triangles: &'a [(u32, bool)],
    /// Numbers of the soil cells whose rows are wanted; rising.
    pub soil_cells: &'a [u32],
}
