// Reading, examining and writing .vdb files.
#pragma once

#include "levelset/grid.h"

#include <functional>
#include <string>
#include <vector>

namespace vshi {

// A grid of a file, as messages name it.
struct GridName {
    const char *path;
    std::string grid;

    std::string text() const { return std::string(path) + ": grid '" + grid + "'"; }
};

// A level set of a file or a caller, before its values are examined.
struct LevelSet {
    GridName name;
    FloatGrid::Ptr grid;
    Matrix matrix;
    double shell; // thickness of open meshes, world units; 0: none
};

// --- messages between a reader and its caller: level sets and voxels as plain arrays (read.cpp)

void encode_level_set(vshi_encoder *encoder, const LevelSet &set);

// Fails with VSH_ERROR_READ for tiles and leaves that are misplaced, out of range or given twice, and for
// numbers that are not finite.
LevelSet decode_level_set(vshi_decoder *decoder, const char *path);

void encode_blocks(vshi_encoder *encoder, const std::string &grid, const Matrix &matrix,
                   const std::vector<vshi_block> &blocks);
std::vector<vshi_block> decode_blocks(vshi_decoder *decoder, const char *path, std::string &grid,
                                      Matrix &matrix);

// An answer of run.reader. It reports the reader's progress to a stage.
class Answer {
  public:
    explicit Answer(Stage &stage_) : stage(stage_) {}
    ~Answer() { vshi_answer_free(&answer); }
    Answer(const Answer &) = delete;
    Answer &operator=(const Answer &) = delete;

    // Sends one request: a VSHI_READ_… for a file, and what `encode` adds. The result lives as long as this.
    vshi_decoder *ask(int32_t kind, const char *path, const std::function<void(vshi_encoder *)> &encode);

  private:
    static bool poll(void *stage, double fraction);

    Stage &stage;
    vshi_answer answer{nullptr, 0, 0, {nullptr, nullptr, true}};
};

// Fails if a request holds more than its kind needs, or less.
void end_request(vshi_decoder *request, const char *path);

// --- checks that a grid from outside is a level set of true distances (examine.cpp)

// A fault of a grid; `text` is empty if there is none.
struct Finding {
    // NOTED: warn, and use the grid as it is. ODD: the surface is right, the distances must be computed
    // again.
    enum Kind { FINE, NOTED, ODD, BAD } kind = FINE;
    std::string text;
};

// Examines class, type of values and transform, without the tree.
Finding examine_kind(const openvdb::GridBase &grid);

// Examines the transform: voxels must be cubes of a size that OpenVDB can write.
Finding examine_matrix(const Matrix &matrix);

// Examines the tree's values; `voxel` is the voxel size, world units.
Finding examine_values(const FloatGrid &grid, double voxel, Stage &stage);

// Fails for a finding that is BAD.
void refuse_bad(const GridName &name, const Finding &finding);

// Makes a handle of a level set of a file or a caller: examines its values, and computes its distances again
// if they are ODD.
vsh_grid *close_level_set(LevelSet &set, Stage &stage);

// --- parsing files (file.cpp)

constexpr const char *SHELL_THICKNESS = "vdbshade_shell_thickness"; // metadata, world units

// Magic number (8 bytes), version of the format (4) and of the library (8), 1 byte, and the file's UUID.
constexpr size_t UUID_AT = 21;
constexpr size_t UUID_LENGTH = 36;

// Initializes OpenVDB, once a process. Call it before anything is read or written.
void initialize();

// Grids with a number, or a bit, in each voxel.
using NumberGrids = openvdb::NumericGridTypes::Append<openvdb::BoolGrid, openvdb::MaskGrid>;

// Grid `name` of a .vdb file (nullptr: the first of NumberGrids), read within the run's memory limit. Fails
// if there is no such grid, or it is no grid of numbers.
openvdb::GridBase::Ptr read_numbers(const char *path, const char *name, const vsh_run &run);

// Level set `name` (nullptr: the first of that class) of a .vdb file, read within the run's memory limit.
// Fails for a wrong class, type or transform.
LevelSet load_level_set(const char *path, const char *name, Stage &stage);

// The shell thickness in our metadata, world units; 0 if there is none.
double shell_of(const openvdb::GridBase &grid);

// Describes up to `capacity` grids of a file; returns how many it has.
size_t list_grids(const char *path, const vsh_run &run, std::vector<vsh_vdb_entry> &entries, size_t capacity);

// --- writing files (write.cpp)

// Least voxel size that OpenVDB can write, world units: it copies the grids, and then smaller volumes are 0.
constexpr double SMALLEST_WRITTEN = 1.45e-5;

// Makes a grid that shares the tree.
FloatGrid::Ptr named_grid(const FloatTree::Ptr &tree, const double *matrix, const std::string &name,
                          openvdb::GridClass grid_class);

// Makes a grid that shares the tree of a handle's level set.
FloatGrid::Ptr named_surface(const vsh_grid &grid, const char *name);

// Writes the grids that `make` returns as one file, atomically. Attributes become metadata, and replace any
// of the same name. Equal grids give equal bytes. Voxels that OpenVDB cannot write are refused before `make`
// is called.
vsh_result write_grids(const char *path, double voxel_size, const vsh_attribute *attributes, size_t count,
                       const std::function<std::vector<FloatGrid::Ptr>()> &make, vsh_error *error);

} // namespace vshi
