// Volumes and .vdb files: the voxels of other grids, and volumes as OpenVDB reads them. It is C++ because
// the library's own calls cannot write or read all of these files.
#include "grid_files.h"

#include "previews.h"

namespace {

using openvdb::Coord;
using openvdb::CoordBBox;
using openvdb::Vec3d;

vsh_voxels *like(const std::string &path, const char *name) {
    vsh_voxels *voxels = nullptr;
    assert_ok(vsh_voxels_from_vdb(path.c_str(), name, nullptr, &voxels, &failure));
    return voxels;
}

vsh_voxels_info info_of(const vsh_voxels *voxels) {
    vsh_voxels_info info;
    vsh_voxels_get_info(voxels, &info);
    return info;
}

// A unit ball at the origin.
vsh_occluders *ball() {
    vsh_sdf_node node = vsh_sdf_node_default();
    OWNED(vsh_grid) *grid = grid_of_tree(&node, 1, with_voxel(0.1));
    vsh_occluders *occluders = nullptr;
    assert_int_equal(vsh_occluders_from_grid(grid, nullptr, nullptr, &occluders, &failure), VSH_OK);
    return occluders;
}

vsh_volume *bake(const vsh_occluders *occluders, const vsh_voxels *voxels, bool ao) {
    vsh_light light = vsh_light_default();
    light.angle = 0.1;
    vsh_volume_options options = preview_volume_options();
    options.ao = ao;
    vsh_volume *volume = nullptr;
    assert_ok(vsh_bake_volume(occluders, voxels, &light, 1, &options, nullptr, &volume, nullptr, &failure));
    return volume;
}

// A volume of the ball's shadow in a box of so many units to each side.
vsh_volume *bake_box(double half, bool ao) {
    const double low[3] = {-half, -half, -half}, high[3] = {half, half, half};
    OWNED(vsh_occluders) *occluders = ball();
    OWNED(vsh_voxels) *voxels = nullptr;
    assert_int_equal(vsh_voxels_from_box(low, high, 0.1, nullptr, &voxels, &failure), VSH_OK);
    return bake(occluders, voxels, ao);
}

// The first grid of a written volume, by OpenVDB's own reader.
FloatGrid::Ptr written(const vsh_volume *volume, const char *name, const char *grid, bool as_half) {
    const std::string path = in_folder(name);
    assert_int_equal(vsh_volume_write(volume, path.c_str(), as_half, nullptr, 0, &failure), VSH_OK);
    openvdb::io::File file(path);
    file.open(false);
    return openvdb::gridPtrCast<FloatGrid>(file.readGrid(grid));
}

// A fog of some voxels and of active tiles, turned, scaled unevenly and moved.
FloatGrid::Ptr fog() {
    const FloatGrid::Ptr grid = FloatGrid::create(0.0f);
    grid->setName("density");
    grid->setGridClass(openvdb::GRID_FOG_VOLUME);
    grid->fill(CoordBBox(-3, 0, 0, 4, 5, 6), 0.5f);
    grid->tree().addTile(1, Coord(16, 16, 16), 0.7f, true);
    grid->tree().addTile(2, Coord(0, -128, 0), 0.9f, true); // 128³
    grid->tree().addTile(1, Coord(32, 16, 16), 0.0f, false);
    const auto transform = openvdb::math::Transform::createLinearTransform(0.05);
    transform->postScale(Vec3d(1.0, 2.0, 1.0));
    transform->postRotate(0.4, openvdb::math::Y_AXIS);
    transform->postTranslate(Vec3d(-2.0, -1.5, 0.3));
    grid->setTransform(transform);
    return grid;
}

TEST(a_fog_is_lit_on_its_voxels_and_its_tiles) {
    const FloatGrid::Ptr source = fog();
    const std::string path = save("fog.vdb", {source});
    OWNED(vsh_voxels) *voxels = like(path, "density");
    const vsh_voxels_info info = info_of(voxels);
    const uint64_t expected = 8 * 6 * 7 + 512 + 128 * 128 * 128;
    assert_int_equal(source->activeVoxelCount(), expected);
    assert_int_equal(info.count, expected);
    assert_true(info.index_min[0] == -3 && info.index_max[0] == 127 && info.has_normals == 0);
    assert_true(std::fabs(info.voxel_size[1] / info.voxel_size[0] - 2.0) < 1e-12);
    const int32_t index[3] = {17, 18, 19};
    double centre[3];
    vshi_voxels_centre(voxels, index, centre);
    assert_true((Vec3d(centre) - source->indexToWorld(Coord(17, 18, 19))).length() < 1e-12);

    OWNED(vsh_occluders) *occluders = ball();
    OWNED(vsh_volume) *volume = bake(occluders, voxels, false);
    const FloatGrid::Ptr lit = written(volume, "lit.vdb", "shadow.sun", false);
    assert_true(lit->transform() == source->transform());
    vsh_volume_info done;
    vsh_volume_get_info(volume, &done);
    assert_int_equal(lit->activeVoxelCount() + done.off, expected);
    // active where the fog is, and nowhere else
    FloatGrid::Ptr beyond = lit->deepCopy();
    beyond->topologyDifference(*source);
    assert_int_equal(beyond->activeVoxelCount(), 0);
    // the fog's large tile is not one value: the ball's shadow passes it, or does not, voxel by voxel
    size_t dark = 0, light = 0;
    for (auto value = lit->cbeginValueOn(); value; ++value) {
        const Vec3d p = lit->indexToWorld(value.getCoord());
        const double aside = std::hypot(p[0], p[2]);
        if (value.isVoxelValue() && p.length() > 1.1 && p[1] < -0.2) {
            const double edge = 0.05 * -p[1] + 0.2;
            assert_true(aside < 1.0 - edge ? *value < 0.02f : aside < 1.0 + edge || *value == 1.0f);
            dark += aside < 1.0 - edge;
            light += aside > 1.0 + edge;
        }
    }
    assert_true(dark > 1000 && light > 100);
}

TEST(grids_of_any_type_are_read_and_the_first_is_the_default) {
    const auto vectors = openvdb::Vec3SGrid::create();
    vectors->setName("velocity");
    vectors->fill(CoordBBox(0, 0, 0, 3, 3, 3), openvdb::Vec3s(1.0f));
    const auto integers = openvdb::Int32Grid::create();
    integers->setName("id");
    integers->fill(CoordBBox(0, 0, 0, 9, 9, 9), 3);
    const auto doubles = openvdb::DoubleGrid::create();
    doubles->setName("heat");
    doubles->fill(CoordBBox(0, 0, 0, 4, 4, 4), 3.0);
    const auto mask = openvdb::MaskGrid::create();
    mask->setName("mask");
    mask->fill(CoordBBox(0, 0, 0, 15, 1, 1), true);
    const std::string path = save("many.vdb", {vectors, integers, doubles, mask});
    static const struct {
        const char *name;
        uint64_t count;
    } grids[] = {{nullptr, 1000}, {"id", 1000}, {"heat", 125}, {"mask", 64}};
    for (const auto &grid : grids) {
        OWNED(vsh_voxels) *voxels = like(path, grid.name);
        assert_int_equal(info_of(voxels).count, grid.count);
    }
}

TEST(grids_without_voxels_are_refused) {
    vsh_voxels *voxels = nullptr;
    const auto refused = [&](const std::string &path, const char *name, vsh_result code,
                             std::initializer_list<const char *> parts) {
        assert_said(vsh_voxels_from_vdb(path.c_str(), name, nullptr, &voxels, &failure), code, parts);
        assert_null(voxels);
    };
    const auto vectors = openvdb::Vec3SGrid::create();
    vectors->setName("velocity");
    const FloatGrid::Ptr empty = FloatGrid::create(1.0f);
    empty->setName("empty");
    const std::string path = save("refused.vdb", {vectors, empty});
    refused(path, "velocity", VSH_ERROR_INPUT, {path.c_str(), "'velocity'", "Tree_vec3s_5_4_3", "numbers"});
    refused(path, "empty", VSH_ERROR_INPUT, {path.c_str(), "'empty'", "no active voxels"});
    const FloatGrid::Ptr frustum = FloatGrid::create(0.0f);
    frustum->fill(CoordBBox(0, 0, 0, 3, 3, 3), 1.0f);
    frustum->setTransform(std::make_shared<openvdb::math::Transform>(
        openvdb::math::NonlinearFrustumMap(openvdb::BBoxd(Vec3d(0.0), Vec3d(8.0)), 0.5, 8.0).copy()));
    refused(save("frustum.vdb", {frustum}), nullptr, VSH_ERROR_INPUT, {"NonlinearFrustumMap", "linear"});
    refused(path, "Empty", VSH_ERROR_INPUT, {"no grid 'Empty'", "'velocity', 'empty'"});
    refused(save("vectors.vdb", {vectors}), nullptr, VSH_ERROR_INPUT, {"'velocity'", "numbers"});
    refused(save("none.vdb", {}), nullptr, VSH_ERROR_INPUT, {"holds no grids"});
    // one tile of the root holds 4096³ voxels
    const FloatGrid::Ptr huge = FloatGrid::create(0.0f);
    huge->setName("huge");
    huge->tree().addTile(3, Coord(0), 1.0f, true);
    const std::string huge_path = save("huge.vdb", {huge});
    const vsh_run run = run_within(uint64_t(1) << 30);
    assert_fails(vsh_voxels_from_vdb(huge_path.c_str(), nullptr, &run, &voxels, &failure), VSH_ERROR_LIMIT,
                 "'huge'");
}

TEST(other_programs_read_names_class_metadata_and_halves) {
    OWNED(vsh_volume) *volume = bake_box(2.0, true);
    const FloatGrid::Ptr full = written(volume, "full.vdb", "shadow.sun", false);
    const FloatGrid::Ptr rounded = written(volume, "half.vdb", "shadow.sun", true);
    assert_true(!full->saveFloatAsHalf() && rounded->saveFloatAsHalf());
    assert_int_equal(full->getGridClass(), openvdb::GRID_UNKNOWN);
    assert_true(full->background() == 1.0f);
    assert_true(full->tree().activeTileCount() > 50);
    assert_true(full->metaValue<std::string>("vdbshade_method") == "cone");
    assert_non_null(
        std::strstr(full->metaValue<std::string>("description").c_str(), "visible fraction of light 'sun'"));
    assert_non_null(std::strstr(full->metaValue<std::string>("vdbshade_light").c_str(), "directional"));
    assert_true(full->metaValue<double>("vdbshade_caster_voxel_size") == 0.1);
    for (auto meta = full->beginMeta(); meta != full->endMeta(); ++meta) {
        const std::string text = meta->second->str();
        const std::string &name = meta->first;
        assert_true(name == "name" || name == "class" || name == "creator" || name == "description" ||
                    name == "is_saved_as_half_float" || name.rfind("vdbshade_", 0) == 0 ||
                    name.rfind("file_", 0) == 0); // no date
        assert_null(std::strstr(text.c_str(), folder));
    }
    size_t halves = 0;
    for (auto value = full->cbeginValueOn(); value; ++value) {
        const float other = rounded->tree().getValue(value.getCoord());
        assert_true(std::fabs(other - *value) < 1.0f / 2048.0f);
        halves += other != *value;
    }
    assert_true(halves > 100 &&
                content(in_folder("half.vdb")).size() < content(in_folder("full.vdb")).size());

    vsh_vdb_entry entries[2];
    size_t count = 0;
    assert_int_equal(vsh_vdb_list(in_folder("full.vdb").c_str(), nullptr, entries, 2, &count, &failure),
                     VSH_OK);
    assert_int_equal(count, 2);
    assert_string_equal(entries[0].name, "shadow.sun");
    assert_string_equal(entries[1].name, "ao");
    assert_string_equal(entries[1].grid_class, "unknown");
    assert_int_equal(entries[1].active_voxels, full->activeVoxelCount());

    // the library copies the values that OpenVDB reads
    const int32_t from[3] = {0, 0, 0}, size[3] = {40, 40, 40};
    std::vector<float> values(40 * 40 * 40);
    assert_int_equal(vsh_volume_copy(volume, 0, from, size, values.data(), &failure), VSH_OK);
    for (size_t i = 0; i < values.size(); ++i) {
        const int32_t n = int32_t(i);
        assert_true(values[i] == full->tree().getValue(Coord(n % 40, n / 40 % 40, n / 1600)));
    }
}

int set_up(void **) {
    return make_folder() ? 0 : 1;
}

FIXTURE(set_up, remove_folder)

} // namespace
