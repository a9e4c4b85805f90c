// Reading, examining and writing .vdb files.
#pragma once

#include "levelset/grid.h"

#include <functional>
#include <string>
#include <vector>

namespace vshi {

// --- grids between a reader and its caller: transforms, level sets and voxels as plain arrays

// A transform: OpenVDB's name of its map, and the numbers that define it, without those that follow from
// them. Maps of files hold both, and damaged ones do not agree.
struct TransformData {
    std::string map;
    std::vector<double> numbers;
};

TransformData describe_transform(const openvdb::math::Transform &transform);

// The transform that OpenVDB reads from a sound file with these numbers. Throws std::invalid_argument for a
// map that is none of the known ones, or has other numbers.
openvdb::math::Transform::Ptr restore_transform(const TransformData &data);

// A grid of a file, as messages name it.
struct Named {
    const char *path;
    std::string grid;

    std::string text() const { return std::string(path) + ": grid '" + grid + "'"; }
};

// A level set as it stands in a file, before its values are looked at.
struct LevelSet {
    Named named;
    FloatGrid::Ptr grid;
    double shell; // world units; 0: none
};

void put_level_set(vshi_encoder *encoder, const LevelSet &set);

// Throws Failure (VSH_ERROR_READ) for what no sound reader sends: tiles and leaves out of place, out of
// range, twice, numbers that are not finite.
LevelSet take_level_set(vshi_decoder *decoder, const char *path, vsh_error *error);

void put_blocks(vshi_encoder *encoder, const std::string &grid, const openvdb::math::Transform &transform,
                const std::vector<vshi_block> &blocks);
std::vector<vshi_block> take_blocks(vshi_decoder *decoder, const char *path, std::string &grid,
                                    openvdb::math::Transform::Ptr &transform, vsh_error *error);

// An answer of run.reader, with the progress of a stage.
class Answer {
  public:
    explicit Answer(Stage &stage_) : stage(stage_) {}
    ~Answer() { vshi_answer_free(&answer); }
    Answer(const Answer &) = delete;
    Answer &operator=(const Answer &) = delete;

    // Asks once, for a VSHI_READ_… of a file and what `encode` adds. The answer lives as long as this. Throws
    // Failure.
    vshi_decoder *ask(int32_t kind, const char *path, const std::function<void(vshi_encoder *)> &encode,
                      vsh_error *error);

  private:
    static bool poll(void *user, double fraction);

    Stage &stage;
    vshi_answer answer{nullptr, 0, 0, {nullptr, nullptr, true}};
};

// Throws Failure where more follows in a request than its kind asks for, or less.
void end_request(vshi_decoder *request, const char *path, vsh_error *error);

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

// Describes up to `capacity` grids of a file; returns how many it has. Throws Failure.
size_t list_grids(const char *path, const vsh_run &run, std::vector<vsh_vdb_entry> &entries, size_t capacity,
                  vsh_error *error);

// Throw Failure for what is BAD, and what passes the memory limit.
void refuse_bad(const Named &named, const Finding &finding, vsh_error *error);
void refuse_large(const Named &named, const vsh_run &run, double bytes, vsh_error *error);

// A grid of ours: shares the tree.
FloatGrid::Ptr named_grid(const FloatTree::Ptr &tree, const openvdb::math::Transform &transform,
                          const std::string &name, openvdb::GridClass grid_class);

// The same of a handle's level set.
FloatGrid::Ptr named_surface(const vsh_grid &grid, const char *name);

// Writes what `make` gives as one file, atomically, with lines of text as metadata that replace any of such
// names; the same grids give the same bytes. Voxels that OpenVDB cannot write are refused before `make` is
// called.
vsh_result write_grids(const char *path, double voxel_size, const vsh_attribute *attributes, size_t count,
                       const std::function<std::vector<FloatGrid::Ptr>()> &make, vsh_error *error);

} // namespace vshi
