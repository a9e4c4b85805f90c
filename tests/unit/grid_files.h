// .vdb files for tests, written with OpenVDB what the library never would. Not with cmocka's C headers
// before.
#ifndef TESTS_GRID_FILES_H
#define TESTS_GRID_FILES_H

#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <functional>
#include <limits>
#include <openvdb/io/File.h>
#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/ChangeBackground.h>
#include <openvdb/tools/LevelSetSphere.h>
#include <string>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <vector>

#include "levelset/access.h"

// Last: it has macros named as OpenVDB's members are.
#include "testing.h"

using openvdb::FloatGrid;

inline std::string folder;

inline std::string in_folder(const char *name) {
    return folder + "/" + name;
}

inline std::string content(const std::string &path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

inline void put(const std::string &path, const std::string &bytes) {
    std::ofstream(path, std::ios::binary) << bytes;
}

inline void assert_said(vsh_result result, vsh_result expected, std::initializer_list<const char *> parts) {
    if (result != expected) {
        print_error("%d %s\n", result, result != VSH_OK ? failure.message : "");
    }
    assert_int_equal(result, expected);
    for (const char *part : parts) {
        if (std::strstr(failure.message, part) == nullptr) {
            print_error("'%s' is not in '%s'\n", part, failure.message);
        }
        assert_non_null(std::strstr(failure.message, part));
    }
}

constexpr double RADIUS = 1.0, VOXEL = 0.05;

// On one thread: what OpenVDB's own threads do is not this test's.
template <class GridType> typename GridType::Ptr ball(double radius, float half_width) {
    openvdb::util::NullInterrupter *none = nullptr;
    return openvdb::tools::createLevelSetSphere<GridType, openvdb::util::NullInterrupter>(
        float(radius), openvdb::Vec3f(0.0f), float(VOXEL), half_width, none, false);
}

inline FloatGrid::Ptr sphere(float half_width = 3.0f) {
    const FloatGrid::Ptr grid = ball<FloatGrid>(RADIUS, half_width);
    grid->setName("sphere");
    return grid;
}

inline std::string save(const char *name, const openvdb::GridPtrVec &grids) {
    const std::string path = in_folder(name);
    openvdb::io::File(path).write(grids);
    return path;
}

inline vsh_grid *own_sphere() {
    vsh_sdf_node node = vsh_sdf_node_default();
    node.radius = RADIUS;
    const vsh_sdf tree = {&node, 1};
    vsh_grid_options options = vsh_grid_options_default();
    options.voxel_size = VOXEL;
    vsh_grid *grid = nullptr;
    assert_int_equal(vsh_grid_from_sdf(&tree, &options, nullptr, &grid, &failure), VSH_OK);
    return grid;
}

inline std::vector<vshi_leaf> leaves_of(const vsh_grid *grid) {
    std::vector<vshi_leaf> leaves(vshi_grid_leaves(grid, nullptr, 0));
    vshi_grid_leaves(grid, leaves.data(), leaves.size());
    return leaves;
}

inline void assert_same(const vsh_grid *a, const vsh_grid *b) {
    const std::vector<vshi_leaf> left = leaves_of(a), right = leaves_of(b);
    assert_int_equal(left.size(), right.size());
    for (size_t i = 0; i < left.size(); ++i) {
        assert_memory_equal(left[i].origin, right[i].origin, sizeof left[i].origin);
        assert_memory_equal(left[i].values, right[i].values, 512 * sizeof(float));
    }
    vsh_grid_info one, other;
    vsh_grid_get_info(a, &one);
    vsh_grid_get_info(b, &other);
    assert_memory_equal(one.transform, other.transform, sizeof one.transform);
    assert_true(one.active_voxels == other.active_voxels && one.half_width == other.half_width &&
                one.shell_thickness == other.shell_thickness);
}

// Largest error in voxels against a sphere at the world's `centre`, over the band.
inline double worst_error(const vsh_grid *grid, double radius, const openvdb::Vec3d &centre) {
    vsh_grid_info info;
    vsh_grid_get_info(grid, &info);
    const double *m = info.transform;
    double worst = 0.0;
    for (const vshi_leaf &leaf : leaves_of(grid)) {
        for (int v = 0; v < 512; ++v) {
            const int index[3] = {leaf.origin[0] + v / 64, leaf.origin[1] + v / 8 % 8,
                                  leaf.origin[2] + v % 8};
            openvdb::Vec3d p;
            for (int row = 0; row < 3; ++row) {
                p[row] = m[4 * row] * index[0] + m[4 * row + 1] * index[1] + m[4 * row + 2] * index[2] +
                         m[4 * row + 3];
            }
            const double band = info.half_width * info.voxel_size;
            const double truth = std::fmax(-band, std::fmin(band, (p - centre).length() - radius));
            worst = std::fmax(worst, std::fabs(double(leaf.values[v]) - truth) / info.voxel_size);
        }
    }
    return worst;
}

struct Warnings {
    std::vector<std::string> lines;
    vsh_run run = vsh_run_default();
    Warnings() {
        run.user = this;
        run.warning = [](void *user, const char *line) {
            static_cast<Warnings *>(user)->lines.emplace_back(line);
        };
    }
};

inline void refused(const char *file, const openvdb::GridBase::Ptr &grid,
                    std::initializer_list<const char *> parts) {
    const std::string path = save(file, {grid});
    vsh_grid *read = nullptr;
    assert_said(vsh_grid_read(path.c_str(), nullptr, nullptr, &read, &failure), VSH_ERROR_INPUT, parts);
    assert_non_null(std::strstr(failure.message, path.c_str()));
    assert_null(read);
    vsh_vdb_entry entry;
    size_t count = 0;
    assert_int_equal(vsh_vdb_list(path.c_str(), nullptr, &entry, 1, &count, &failure), VSH_OK);
    for (const char *part : parts) {
        assert_non_null(std::strstr(entry.problem, part));
    }
}

// A sphere of 2 voxels' band, which is measured again.
inline FloatGrid::Ptr narrow_sphere(const char *name, float radius) {
    const FloatGrid::Ptr grid = ball<FloatGrid>(double(radius), 2.0f);
    grid->setName(name);
    return grid;
}

inline int remove_folder(void **) {
    return std::system(("rm -r '" + folder + "'").c_str());
}

// A folder of the test's own, and OpenVDB ready; false where there is none.
inline bool make_folder() {
    const char *place = std::getenv("TMPDIR");
    folder = std::string(place != nullptr ? place : ".") + "/vdbshade-grid-file-XXXXXX";
    openvdb::initialize();
    return mkdtemp(folder.data()) != nullptr;
}

inline int begin_folder(void **) {
    return make_folder() ? 0 : 1;
}

#endif
