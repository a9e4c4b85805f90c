// What the shims that read and write .vdb files share.
#pragma once

#include "levelset/grid.h"
#include "levelset/message.h"

#include <string>
#include <vector>

namespace vshi {

// --- whether a grid that came from outside is a level set of true distances

// A fault of a grid; `text` is empty if there is none.
struct Finding {
    // NOTED: warn, and use the grid as it is. ODD: the surface is right, the distances must be made anew.
    enum Kind { FINE, NOTED, ODD, BAD } kind = FINE;
    std::string text;
};

// Examines class, type of values and transform, without the tree.
Finding examine_kind(const openvdb::GridBase &grid);

// Voxel size of a transform that examine_kind() found fine, world units.
double voxel_size(const openvdb::GridBase &grid);

// Examines the tree's values.
Finding examine_values(const FloatGrid &grid, Stage &stage);

// True distances for an ODD grid: the same surface, signs and transform, a band that is 3 voxels wide at
// least. Messages do not name the file: its reader does.
FloatGrid::Ptr mend(const FloatGrid &grid, Stage &stage, vsh_error *error);

// --- files

constexpr const char *SHELL_THICKNESS = "vdbshade_shell_thickness"; // metadata, world units

// Magic number (8 bytes), version of the format (4) and of the library (8), 1 byte, and the file's UUID.
constexpr size_t UUID_AT = 21;
constexpr size_t UUID_LENGTH = 36;

// Voxels below, world units, OpenVDB cannot write: it takes their volume for 0 while it copies what it
// writes.
constexpr double SMALLEST_WRITTEN = 1.45e-5;

// Once a process, before anything is read or written.
void initialize();

// Grids with a number, or a bit, in each voxel.
using NumberGrids = openvdb::NumericGridTypes::Append<openvdb::BoolGrid, openvdb::MaskGrid>;

// Grid `name` of a .vdb file (nullptr: the first of NumberGrids), its tree read within the run's memory
// limit; throws Failure where there is none, and where it is none of them.
openvdb::GridBase::Ptr read_numbers(const char *path, const char *name, const vsh_run &run, vsh_error *error);

// Level set `name` (nullptr: the first of that class) of a .vdb file, of a sound kind, within the run's
// memory limit. Throws Failure.
LevelSet load_level_set(const char *path, const char *name, Stage &stage, vsh_error *error);

// Makes a handle of a level set from outside: checks its values, and measures its distances anew where they
// are none. Throws Failure.
vsh_grid *close_level_set(LevelSet &set, Stage &stage, vsh_error *error);

// What our metadata say of it, world units; 0: nothing.
double shell_of(const openvdb::GridBase &grid);

// Up to `capacity` grids of a file, described; `count` is that of the file's. Throws Failure.
void list_grids(const char *path, const vsh_run &run, std::vector<vsh_vdb_entry> &entries, size_t capacity,
                size_t &count, vsh_error *error);

// Throw Failure for what is BAD, and what passes the memory limit.
void refuse_bad(const Named &named, const Finding &finding, vsh_error *error);
void refuse_large(const Named &named, const vsh_run &run, double bytes, vsh_error *error);

// Refuses voxels that OpenVDB cannot write, before a grid is copied.
vsh_result check_writable(const char *path, double voxel_size, vsh_error *error);

// A grid of ours: shares the tree.
FloatGrid::Ptr named_grid(const FloatTree::Ptr &tree, const openvdb::math::Transform &transform,
                          const std::string &name, openvdb::GridClass grid_class);

// The same of a handle's level set.
FloatGrid::Ptr named_surface(const vsh_grid &grid, const char *name);

// Lines of text as metadata; those that are there under such a name are replaced.
void put_attributes(FloatGrid &grid, const vsh_attribute *attributes, size_t count);

// Writes float grids as one file, atomically; the same grids give the same bytes.
vsh_result write_grids(const openvdb::GridCPtrVec &grids, const char *path, vsh_error *error);

} // namespace vshi
