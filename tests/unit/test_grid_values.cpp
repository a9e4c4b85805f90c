// .vdb files of others: their transforms, and values that are no distances or end too soon, become a level
// set.
#include "grid_files.h"

namespace {

TEST(turned_and_mirrored_grids_stay_where_they_are) {
    const FloatGrid::Ptr grid = sphere();
    grid->transform().postRotate(0.7, openvdb::math::Y_AXIS);
    grid->transform().postScale(openvdb::Vec3d(-2.0, 2.0, 2.0));
    grid->transform().postTranslate(openvdb::Vec3d(5.0, -3.0, 100.0));
    for (auto value = grid->beginValueAll(); value; ++value) {
        value.setValue(2.0f * *value);
    }
    openvdb::tools::changeBackground(grid->tree(), 2.0f * grid->background());
    const std::string path = save("turned.vdb", {grid}), copy = in_folder("turned2.vdb");
    OWNED(vsh_grid) *read = nullptr, *back = nullptr;
    Warnings warnings;
    assert_said(vsh_grid_read(path.c_str(), nullptr, &warnings.run, &read, &failure), VSH_OK, {});
    assert_true(warnings.lines.empty());
    assert_true(worst_error(read, 2.0 * RADIUS, openvdb::Vec3d(5.0, -3.0, 100.0)) < 0.01);
    assert_int_equal(vsh_grid_write(read, copy.c_str(), nullptr, nullptr, 0, &failure), VSH_OK);
    assert_said(vsh_grid_read(copy.c_str(), nullptr, nullptr, &back, &failure), VSH_OK, {});
    assert_same(read, back);
}

TEST(doubles_are_read) {
    const auto grid = ball<openvdb::DoubleGrid>(RADIUS, 4.0f);
    const std::string path = save("double.vdb", {grid});
    OWNED(vsh_grid) *read = nullptr;
    assert_said(vsh_grid_read(path.c_str(), nullptr, nullptr, &read, &failure), VSH_OK, {});
    assert_true(worst_error(read, RADIUS, openvdb::Vec3d(0.0)) < 0.01);
}

TEST(values_that_are_no_distances_are_made_so) {
    const FloatGrid::Ptr scaled = sphere(), turned = sphere(2.0f), wide = sphere();
    for (auto value = scaled->beginValueAll(); value; ++value) {
        value.setValue(0.3f * *value); // the background stays
    }
    turned->transform().postRotate(0.7, openvdb::math::Y_AXIS);
    turned->transform().postTranslate(openvdb::Vec3d(1.0, 2.0, 3.0));
    openvdb::tools::changeLevelSetBackground(wide->tree(), float(9.0 * VOXEL));
    const struct {
        FloatGrid::Ptr grid;
        const char *reason;
        openvdb::Vec3d centre;
    } cases[] = {{scaled, "", openvdb::Vec3d(0.0)},
                 {turned, "half width of 2 voxels", openvdb::Vec3d(1.0, 2.0, 3.0)},
                 {wide, "before they reach the background", openvdb::Vec3d(0.0)}};
    for (const auto &one : cases) {
        const std::string path = save("odd.vdb", {one.grid});
        Warnings warnings;
        OWNED(vsh_grid) *read = nullptr;
        assert_said(vsh_grid_read(path.c_str(), nullptr, &warnings.run, &read, &failure), VSH_OK, {});
        assert_int_equal(warnings.lines.size(), 1);
        assert_non_null(std::strstr(warnings.lines[0].c_str(), one.reason));
        assert_true(worst_error(read, RADIUS, one.centre) < 0.1);
        vsh_vdb_entry entry = {};
        size_t count = 0;
        assert_int_equal(vsh_vdb_list(path.c_str(), nullptr, &entry, 1, &count, &failure), VSH_OK);
        assert_non_null(std::strstr(entry.problem, one.reason));
        assert_int_equal(entry.mended, 1);
    }
}

// Walls of 0.6 to 1.5 voxels, wherever they stand between the voxels: their distances are right, and stay.
TEST(thin_walls_hold_distances) {
    for (const double half : {0.3, 0.45, 0.6, 0.75}) {
        for (const double offset : {0.0, 0.14, 0.27}) {
            const FloatGrid::Ptr grid = FloatGrid::create(float(3.0 * VOXEL));
            grid->setTransform(openvdb::math::Transform::createLinearTransform(VOXEL));
            grid->setGridClass(openvdb::GRID_LEVEL_SET);
            for (const openvdb::Coord at : openvdb::CoordBBox(openvdb::Coord(-14), openvdb::Coord(14))) {
                const openvdb::Vec3d q(std::fabs(at.x()) - 10.0, std::fabs(at.y()) - 10.0,
                                       std::fabs(at.z() - offset) - half);
                const openvdb::Vec3d outside(std::max(q.x(), 0.0), std::max(q.y(), 0.0),
                                             std::max(q.z(), 0.0));
                const double distance = outside.length() + std::min(std::max({q.x(), q.y(), q.z()}), 0.0);
                if (std::fabs(distance) < 3.0) {
                    grid->tree().setValue(at, float(VOXEL * distance));
                }
            }
            Warnings warnings;
            OWNED(vsh_grid) *read = nullptr;
            const std::string path = save("wall.vdb", {grid});
            assert_said(vsh_grid_read(path.c_str(), nullptr, &warnings.run, &read, &failure), VSH_OK, {});
            assert_true(warnings.lines.empty());
        }
    }
}

// Shadows under the sphere, seen as the reader left it.
std::vector<float> shadows_of(const vsh_grid *grid) {
    OWNED(vsh_occluders) *occluders = nullptr;
    assert_said(vsh_occluders_from_grid(grid, nullptr, nullptr, &occluders, &failure), VSH_OK, {});
    std::vector<double> positions;
    for (int i = 0; i < 60; ++i) {
        positions.insert(positions.end(), {0.03 * i, -2.5, 0.01});
    }
    vsh_light light = vsh_light_default();
    light.angle = 0.2;
    const vsh_points points = {positions.size() / 3, positions.data(), nullptr, nullptr};
    std::vector<float> visible(points.count);
    assert_said(vsh_shade_shadow(occluders, &points, &light, nullptr, nullptr, visible.data(), nullptr,
                                 nullptr, &failure),
                VSH_OK, {});
    return visible;
}

// Bands of other widths too: narrower ones than 3 voxels are made anew.
// Distances in all voxels of a box, as arrays become grids: beyond the background, too.
TEST(dense_distances_are_no_damage) {
    const FloatGrid::Ptr grid = FloatGrid::create(float(3.0 * VOXEL));
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    grid->setTransform(openvdb::math::Transform::createLinearTransform(VOXEL));
    auto values = grid->getAccessor();
    for (int i = 0; i < 64 * 64 * 64; ++i) {
        const openvdb::Coord at(i / 4096 - 32, i / 64 % 64 - 32, i % 64 - 32);
        values.setValue(at, float(VOXEL * at.asVec3d().length() - RADIUS));
    }
    const std::string path = save("dense.vdb", {grid});
    Warnings warnings;
    vsh_grid *read = nullptr;
    assert_said(vsh_grid_read(path.c_str(), nullptr, &warnings.run, &read, &failure), VSH_OK, {});
    assert_true(warnings.lines.empty());
    assert_true(worst_error(read, RADIUS, openvdb::Vec3d(0.0)) < 0.01);
    vsh_grid_free(read);
    vsh_vdb_entry entry = {};
    size_t count = 0;
    assert_int_equal(vsh_vdb_list(path.c_str(), nullptr, &entry, 1, &count, &failure), VSH_OK);
    assert_string_equal(entry.problem, "");
    values.setValue(openvdb::Coord(28, 3, 4), 1e9f);
    save("dense.vdb", {grid});
    assert_said(vsh_grid_read(path.c_str(), nullptr, &warnings.run, &read, &failure), VSH_OK, {});
    assert_true(warnings.lines.size() == 1 && std::strstr(warnings.lines[0].c_str(), "damaged?") != nullptr);
    vsh_grid_free(read);
}

TEST(scaled_values_and_narrow_bands_cast_the_same_shadows) {
    vsh_grid *own = own_sphere();
    const std::vector<float> expected = shadows_of(own);
    vsh_grid_free(own);
    const struct {
        float factor, half_width;
        size_t warnings;
    } cases[] = {{1.0f, 3.0f, 0},   {2.0f, 3.0f, 1},  {0.5f, 3.0f, 1}, {0.5f, 10.0f, 1}, {2.0f, 10.0f, 1},
                 {1.0f, 100.0f, 0}, {1.0f, 1.25f, 1}, {1.0f, 2.0f, 1}, {16.0f, 3.0f, 1}, {0.01f, 5.0f, 1}};
    for (const auto &one : cases) {
        const FloatGrid::Ptr grid = sphere(one.half_width);
        for (auto value = grid->beginValueAll(); value; ++value) {
            value.setValue(one.factor * *value);
        }
        openvdb::tools::changeBackground(grid->tree(), one.factor * grid->background());
        const std::string path = save("scaled.vdb", {grid});
        Warnings warnings;
        OWNED(vsh_grid) *read = nullptr;
        assert_said(vsh_grid_read(path.c_str(), nullptr, &warnings.run, &read, &failure), VSH_OK, {});
        assert_int_equal(warnings.lines.size(), one.warnings);
        const std::vector<float> visible = shadows_of(read);
        float worst = 0.0f;
        for (size_t i = 0; i < visible.size(); ++i) {
            worst = std::max(worst, std::fabs(visible[i] - expected[i]));
        }
        print_message("values times %g, half width %g: shadows %.4f apart at most\n", double(one.factor),
                      double(one.half_width), double(worst));
        assert_true(worst < 0.03f);
    }
}

TEST(what_is_all_inside_is_refused) {
    const FloatGrid::Ptr grid = sphere(), inside = sphere();
    for (auto value = grid->beginValueAll(); value; ++value) {
        value.setValue(-std::fabs(*value));
    }
    refused("inside.vdb", grid, {"no value is above 0"});
    for (auto value = inside->beginValueAll(); value; ++value) {
        value.setValue(-std::fabs(*value));
    }
    inside->tree().root().setBackground(-inside->background(), false);
    refused("inside.vdb", inside, {"outside must be positive"});
}

TEST(making_distances_anew_names_the_file_and_the_grid) {
    const FloatGrid::Ptr narrow = narrow_sphere("hull", 3.0f), wide = sphere();
    const std::string path = save("narrow.vdb", {narrow});
    vsh_run run = vsh_run_default();
    run.memory_limit = 3 * narrow->memUsage(); // to read it, and no more
    OWNED(vsh_grid) *read = nullptr;
    assert_said(vsh_grid_read(path.c_str(), nullptr, &run, &read, &failure), VSH_ERROR_LIMIT,
                {path.c_str(), "grid 'hull'", "voxel size 0.05", "over the memory limit"});
    assert_null(read);

    // Distances that end at 3 voxels, but say 40: the band that is made is foretold, not the one that is
    // there.
    openvdb::tools::changeLevelSetBackground(wide->tree(), float(40.0 * VOXEL));
    wide->setName("wide");
    const std::string wide_path = save("wide.vdb", {wide});
    run.memory_limit = 4 * wide->memUsage();
    assert_said(vsh_grid_read(wide_path.c_str(), nullptr, &run, &read, &failure), VSH_ERROR_LIMIT,
                {wide_path.c_str(), "grid 'wide'", "over the memory limit"});
    run.memory_limit = 1000000000;
    assert_said(vsh_grid_read(wide_path.c_str(), nullptr, &run, &read, &failure), VSH_OK, {});
    vsh_grid_info info;
    vsh_grid_get_info(read, &info);
    assert_true(info.active_voxels > 4 * wide->activeVoxelCount());
}

} // namespace

FIXTURE(begin_folder, remove_folder)
