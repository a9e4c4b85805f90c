// .vdb files for tests, written by OpenVDB in ways that the library never would. Include this before cmocka's
// C headers.
#pragma once

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
#include "folder.h"

using openvdb::FloatGrid;

inline std::string in_folder(const char *name) {
    return at(name);
}

inline std::string content(const std::string &path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

inline void put(const std::string &path, const std::string &bytes) {
    std::ofstream(path, std::ios::binary) << bytes;
}

inline void assert_said(vsh_result result, vsh_result expected, std::initializer_list<const char *> parts) {
    assert_that(result == expected, "%d %s", result, result != VSH_OK ? failure.message : "");
    for (const char *part : parts) {
        assert_that(std::strstr(failure.message, part) != nullptr, "'%s' is not in '%s'", part,
                    failure.message);
    }
}

constexpr double RADIUS = 1.0, VOXEL = 0.05;

// Uses one thread, because tests do not cover OpenVDB's own threads.
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

// A folder of the test's own, and OpenVDB ready; false if it cannot be made.
inline bool make_folder() {
    openvdb::initialize();
    return make_folder(nullptr) == 0;
}
