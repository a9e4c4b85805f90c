/* A C++ program that exchanges OpenVDB grids with the library, without a file. */
#include <cmath>
#include <cstdio>
#include <cstring>
#include <openvdb/tools/LevelSetSphere.h>

#include <vdbshade/vdbshade.h>

static int failures;

static void expect(const char *what, bool holds) {
    std::printf("%-60s %s\n", what, holds ? "ok" : "WRONG");
    failures += holds ? 0 : 1;
}

static bool same_values(const openvdb::FloatGrid &a, const openvdb::FloatGrid &b) {
    size_t count = 0, same = 0;
    const auto at = b.getConstAccessor();
    for (auto value = a.cbeginValueOn(); value; ++value, ++count) {
        same += at.getValue(value.getCoord()) == *value && at.isValueOn(value.getCoord()) ? 1 : 0;
    }
    return count > 1000 && same == count && b.activeVoxelCount() == count;
}

int main() {
    const vsh_run sized = vsh_run_default();
    expect("structs have the size that they have in C",
           sized.struct_size == sizeof sized &&
               vsh_lightmap_options_default().struct_size == sizeof(vsh_lightmap_options) &&
               vsh_render_options_default().struct_size == sizeof(vsh_render_options) &&
               vsh_bake_stats_zero().struct_size == sizeof(vsh_bake_stats));
    openvdb::initialize();
    vsh_error error = {VSH_OK, ""};
    const openvdb::FloatGrid::Ptr ball = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(
        1.0f, openvdb::Vec3f(0.5f, 2.0f, 0.0f), 0.05f, 3.0f);
    const openvdb::FloatGrid::Ptr kept = ball->deepCopy();

    vsh_grid *grid = nullptr;
    expect("a level set in memory becomes a handle",
           vdbshade::grid_from_openvdb(ball, nullptr, &grid, &error) == VSH_OK);
    if (grid == nullptr) {
        std::fprintf(stderr, "%s\n", error.message);
        return 1;
    }
    ball->clear(); /* the handle has values of its own */
    openvdb::FloatGrid::ConstPtr back;
    expect("and a grid again", vdbshade::grid_to_openvdb(grid, back, &error) == VSH_OK);
    expect("with the same values", same_values(*kept, *back));
    expect("in the same place", back->transform() == kept->transform());
    expect("of the class level set", back->getGridClass() == openvdb::GRID_LEVEL_SET);

    vsh_occluders *occluders = nullptr;
    expect("which casts", vsh_occluders_from_grid(grid, nullptr, nullptr, &occluders, &error) == VSH_OK);
    float distance = 0.0f;
    const double point[3] = {0.5, 0.5, 0.0};
    vsh_field_sample(vsh_occluders_get_field(occluders, nullptr), 1, point, &distance);
    expect("from where it is", std::fabs(distance - 0.5f) < 0.05f);

    vsh_voxels *voxels = nullptr;
    vsh_volume *volume = nullptr;
    const double low[3] = {0, 0, 0}, high[3] = {1, 0.8, 1};
    vsh_light sun = vsh_light_default();
    std::strcpy(sun.name, "sun");
    expect("a volume is baked", vsh_voxels_from_box(low, high, 0.1, nullptr, &voxels, &error) == VSH_OK &&
                                    vsh_bake_volume(occluders, voxels, &sun, 1, nullptr, nullptr, &volume,
                                                    nullptr, &error) == VSH_OK);
    vsh_grid_free(grid);
    openvdb::FloatGrid::ConstPtr shadow;
    expect("and is a grid", vdbshade::volume_to_openvdb(volume, 0, shadow, &error) == VSH_OK);
    const int32_t first[3] = {2, 2, 2}, one[3] = {1, 1, 1};
    float value = -1.0f;
    expect("with its values", vsh_volume_copy(volume, 0, first, one, &value, &error) == VSH_OK &&
                                  shadow->tree().getValue(openvdb::Coord(2, 2, 2)) == value);
    expect("its name", shadow->getName() == "shadow.sun");
    vsh_volume_free(volume);
    expect("and lives on", shadow->tree().getValue(openvdb::Coord(2, 2, 2)) == value);
    expect("no grid beyond the last", [&] {
        vsh_volume *none = nullptr;
        return vsh_bake_volume(occluders, voxels, &sun, 1, nullptr, nullptr, &none, nullptr, &error) ==
                   VSH_OK &&
               vdbshade::volume_to_openvdb(none, 1, shadow, &error) == VSH_ERROR_ARGUMENT &&
               (vsh_volume_free(none), true);
    }());

    vsh_grid *none = nullptr;
    const openvdb::FloatGrid::ConstPtr given = kept;
    expect("a grid of another OpenVDB is refused",
           vsh_grid_from_openvdb(&given, OPENVDB_LIBRARY_VERSION_NUMBER + 1, OPENVDB_ABI_VERSION_NUMBER,
                                 nullptr, &none, &error) == VSH_ERROR_UNSUPPORTED &&
               none == nullptr && std::strstr(error.message, OPENVDB_LIBRARY_VERSION_STRING) != nullptr);
    openvdb::FloatGrid::ConstPtr fog;
    expect("no grid is refused",
           vdbshade::grid_from_openvdb(fog, nullptr, &none, &error) == VSH_ERROR_ARGUMENT);
    const openvdb::FloatGrid::Ptr other = kept->deepCopy();
    other->setGridClass(openvdb::GRID_FOG_VOLUME);
    fog = other;
    expect("and what is no level set",
           vdbshade::grid_from_openvdb(fog, nullptr, &none, &error) == VSH_ERROR_INPUT);
    vsh_run run = vsh_run_default();
    run.memory_limit = 100000;
    expect("and what passes the memory limit",
           vdbshade::grid_from_openvdb(given, &run, &none, &error) == VSH_ERROR_LIMIT);

    vsh_voxels_free(voxels);
    vsh_occluders_free(occluders);
    return failures > 0 ? 1 : 0;
}
