// Times the level set of a mesh with 512 voxels, its field, and OpenVDB's meshToVolume for the same
// triangles. Milliseconds of processor time of one thread; the ratio is OpenVDB's time over ours.
//
//   vsh_levelset FILE.csv
#include "common.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/MeshToVolume.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <memory>
#include <string>
#include <vector>

namespace {

constexpr int RUNS = 5, ROWS = 500; // of the ball: a million triangles

struct soup {
    std::vector<float> positions;
    std::vector<uint32_t> indices;
};

template <typename Body> double milliseconds(Body &&body) {
    const auto now = [] {
        timespec t;
        clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
        return 1e3 * double(t.tv_sec) + 1e-6 * double(t.tv_nsec);
    };
    const double begin = now();
    body();
    return now() - begin;
}

double median(std::vector<double> &times) {
    std::sort(times.begin(), times.end());
    return times[times.size() / 2];
}

void mesh_to_volume(const soup &triangles, double voxel, double half_width) {
    std::vector<openvdb::Vec3s> points(triangles.positions.size() / 3);
    for (size_t i = 0; i < points.size(); ++i) {
        points[i] = openvdb::Vec3s(&triangles.positions[3 * i]) / float(voxel);
    }
    std::vector<openvdb::Vec4I> polygons(triangles.indices.size() / 3);
    for (size_t i = 0; i < polygons.size(); ++i) {
        const uint32_t *corner = &triangles.indices[3 * i];
        polygons[i] = {corner[0], corner[1], corner[2], openvdb::util::INVALID_IDX};
    }
    tbb::task_arena(1).execute([&] {
        const openvdb::tools::QuadAndTriangleDataAdapter<openvdb::Vec3s, openvdb::Vec4I> mesh(points,
                                                                                              polygons);
        const auto unit = openvdb::math::Transform::createLinearTransform(1.0);
        openvdb::tools::meshToVolume<openvdb::FloatGrid>(mesh, *unit, float(half_width), float(half_width));
    });
}

// All of the meshes' triangles in one list, world units.
soup gather(const std::vector<vsh_mesh> &meshes) {
    soup all;
    for (const vsh_mesh &m : meshes) {
        const auto base = uint32_t(all.positions.size() / 3);
        for (size_t v = 0; v < m.vertex_count; ++v) {
            const float *p = m.positions + 3 * v;
            for (int row = 0; row < 3; ++row) {
                const double *t = m.transform != nullptr ? m.transform + 4 * row : nullptr;
                all.positions.push_back(t == nullptr ? p[row]
                                                     : float(t[0] * p[0] + t[1] * p[1] + t[2] * p[2] + t[3]));
            }
        }
        for (size_t k = 0; k < 3 * m.triangle_count; ++k) {
            all.indices.push_back(base + m.indices[k]);
        }
    }
    return all;
}

void measure(FILE *csv, const char *name, const std::vector<vsh_mesh> &meshes) {
    vsh_error error;
    vsh_run run = vsh_run_default();
    run.threads = 1;
    vsh_grid_options options = vsh_grid_options_default();
    options.resolution = 512;
    const soup all = gather(meshes);
    std::vector<double> times[3];
    vsh_grid_info info;
    for (int i = 0; i < RUNS; ++i) {
        vsh_grid *grid = nullptr;
        vsh_occluders *occluders = nullptr;
        times[0].push_back(milliseconds([&] {
            bench_check(vsh_grid_from_meshes(meshes.data(), meshes.size(), &options, &run, &grid, &error),
                        &error);
        }));
        times[1].push_back(milliseconds(
            [&] { bench_check(vsh_occluders_from_grid(grid, nullptr, &run, &occluders, &error), &error); }));
        vsh_grid_get_info(grid, &info);
        vsh_occluders_free(occluders);
        vsh_grid_free(grid);
        times[2].push_back(milliseconds([&] { mesh_to_volume(all, info.voxel_size, options.half_width); }));
    }
    const double ours = median(times[0]), fields = median(times[1]), theirs = median(times[2]);
    const size_t count = all.indices.size() / 3;
    for (FILE *file : {csv, stdout}) {
        fprintf(file, "%s,%zu,%.6g,%.1f,%.1f,%.1f,%.2f\n", name, count, info.voxel_size, ours, fields, theirs,
                theirs / ours);
        fflush(file);
    }
}

void measure_asset(FILE *csv, const std::string &name) {
    vsh_error error;
    vsh_model *model = nullptr;
    bench_check(vsh_model_read((VSH_ASSETS "/" + name).c_str(), nullptr, &model, &error), &error);
    std::vector<vsh_mesh> meshes;
    for (size_t i = 0; i < vsh_model_mesh_count(model); ++i) {
        meshes.push_back(vsh_model_mesh(model, i, -1));
    }
    measure(csv, name.c_str(), meshes);
    vsh_model_free(model);
}

// A ball with bumps, of ROWS × 2 ROWS quads.
void measure_ball(FILE *csv) {
    constexpr int COLUMNS = 2 * ROWS;
    soup ball;
    for (int i = 0; i <= ROWS; ++i) {
        for (int k = 0; k < COLUMNS; ++k) {
            const double polar = M_PI * i / ROWS, around = M_PI * k / ROWS;
            const double edge = i == 0 || i == ROWS ? 0.0 : std::sin(polar);
            const double x = edge * std::cos(around), y = std::cos(polar), z = edge * std::sin(around);
            const double r =
                1.0 + 0.05 * (std::sin(7 * x + 3 * y) + std::sin(9 * y + 2 * z) + std::sin(11 * z + 5 * x)) +
                0.045 * std::sin(40 * x) * std::sin(37 * y) * std::sin(43 * z);
            ball.positions.insert(ball.positions.end(), {float(r * x), float(r * y), float(r * z)});
        }
    }
    for (uint32_t i = 0; i < ROWS; ++i) {
        for (uint32_t k = 0; k < COLUMNS; ++k) {
            const uint32_t a = i * COLUMNS + k, b = i * COLUMNS + (k + 1) % COLUMNS, c = a + COLUMNS,
                           d = b + COLUMNS;
            ball.indices.insert(ball.indices.end(), {a, b, c, b, d, c});
        }
    }
    vsh_mesh mesh = {};
    mesh.name = "ball";
    mesh.positions = ball.positions.data();
    mesh.indices = ball.indices.data();
    mesh.vertex_count = ball.positions.size() / 3;
    mesh.triangle_count = ball.indices.size() / 3;
    measure(csv, "a million triangles", {mesh});
}

} // namespace

int main(int argc, char **argv) {
    FILE *csv = argc == 2 ? fopen(argv[1], "w") : nullptr;
    if (csv == nullptr) {
        fputs("usage: vsh_levelset FILE.csv\n", stderr);
        return 2;
    }
    fputs("mesh,triangles,voxel,level_set_ms,field_ms,openvdb_ms,ratio\n", csv);
    for (const char *name : {"smooth.glb", "thin.glb", "cloister.glb"}) {
        measure_asset(csv, name);
    }
    measure_ball(csv);
    return fclose(csv) == 0 ? 0 : 3;
}
