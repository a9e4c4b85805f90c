// Several level sets of one file and of others in one scene are their union. In C++, as the library writes
// one grid a file.
#include <cmath>
#include <cstdio>
#include <cstring>
#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetSphere.h>
#include <string>
#include <vector>

#include "levelset/access.h"
#include "previews.h"

// Last: it has macros named as OpenVDB's members are.
#include "testing.h"

namespace {

constexpr float VOXEL = 0.05F;
constexpr const char *PAIR = "test_scene_grids_pair.vdb", *SINGLE = "test_scene_grids_single.vdb";

openvdb::FloatGrid::Ptr ball(const char *name, float x, float radius) {
    auto grid =
        openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(radius, openvdb::Vec3f(x, 0, 0), VOXEL);
    grid->setName(name);
    return grid;
}

int write_files(void **) {
    openvdb::initialize();
    openvdb::io::File(PAIR).write(openvdb::GridPtrVec{ball("left", -2.0F, 0.5F), ball("right", 2.0F, 0.75F)});
    openvdb::io::File(SINGLE).write(openvdb::GridPtrVec{ball("lone", 0.0F, 0.4F)});
    return 0;
}

int remove_files(void **) {
    return std::remove(PAIR) + std::remove(SINGLE);
}

struct Ball {
    double centre[3];
    double radius;
};

// Where the casters below put them.
constexpr Ball BALLS[] = {
    {{-2, 0, 0}, 0.5}, {{2, 0, 0}, 0.75}, {{0, 0, 0}, 0.4}, {{-1, 2, 0}, 0.25}, {{2, -2, 1}, 0.75}};

double truth(const double p[3]) {
    double least = INFINITY;
    for (const Ball &b : BALLS) {
        const double d = std::hypot(p[0] - b.centre[0], p[1] - b.centre[1], p[2] - b.centre[2]) - b.radius;
        least = d < least ? d : least;
    }
    return least;
}

vsh_caster caster(const char *path, const char *grid, double scale, double x, double y, double z) {
    vsh_caster made{};
    made.type = VSH_CASTER_VDB;
    made.path = path;
    made.grid = grid;
    const double transform[12] = {scale, 0, 0, x, 0, scale, 0, y, 0, 0, scale, z};
    std::memcpy(made.transform, transform, sizeof transform);
    return made;
}

TEST(several_grids_and_files_are_their_union) {
    const vsh_caster casters[] = {caster(PAIR, "left", 1, 0, 0, 0), caster(PAIR, "right", 1, 0, 0, 0),
                                  caster(SINGLE, nullptr, 1, 0, 0, 0), caster(PAIR, "left", 0.5, 0, 2, 0),
                                  caster(PAIR, "right", 1, 0, -2, 1)};
    vsh_scene scene{};
    scene.casters = casters;
    scene.caster_count = sizeof casters / sizeof casters[0];
    scene.grid = vsh_grid_options_default();
    scene.grid.voxel_size = static_cast<double>(VOXEL);
    scene.shade = preview_options();
    OWNED(vsh_assets) *assets = nullptr;
    OWNED(vsh_grid) *grid = nullptr;
    assert_ok(vsh_assets_load(&scene, nullptr, &assets, &failure));
    assert_ok(vsh_scene_casters(&scene, assets, nullptr, &grid, &failure));
    const size_t count = vshi_grid_leaves(grid, nullptr, 0);
    std::vector<vshi_leaf> leaves(count);
    vshi_grid_leaves(grid, leaves.data(), count);
    vsh_grid_info info;
    vsh_grid_get_info(grid, &info);
    const double *m = info.transform;
    double worst = 0.0;
    size_t surfaces[5] = {};
    for (const vshi_leaf &leaf : leaves) {
        for (int v = 0; v < 512; ++v) {
            const double i[3] = {double(leaf.origin[0] + (v >> 6)), double(leaf.origin[1] + ((v >> 3) & 7)),
                                 double(leaf.origin[2] + (v & 7))};
            double p[3];
            for (int row = 0; row < 3; ++row) {
                const double *r = m + 4 * row;
                p[row] = r[0] * i[0] + r[1] * i[1] + r[2] * i[2] + r[3];
            }
            const double expected = truth(p), voxel = static_cast<double>(VOXEL);
            if (std::fabs(expected) < 2.0 * voxel) {
                worst = std::fmax(worst, std::fabs(static_cast<double>(leaf.values[v]) - expected) / voxel);
            }
            for (int b = 0; b < 5; ++b) {
                const Ball &one = BALLS[b];
                const double d =
                    std::hypot(p[0] - one.centre[0], p[1] - one.centre[1], p[2] - one.centre[2]) - one.radius;
                surfaces[b] += std::fabs(d) < 0.5 * voxel;
            }
        }
    }
    assert_true(worst < 0.2);
    for (size_t seen : surfaces) { // every one of them is there
        assert_true(seen > 50);
    }
}

FIXTURE(write_files, remove_files)

} // namespace
