// Distances to surfaces of triangles and quads, by OpenVDB's mesh conversion.
#include "levelset/surface.h"

#include "levelset/closest.h"

#include <chrono>
#include <cmath>
#include <openvdb/tools/ChangeBackground.h>
#include <openvdb/tools/MeshToVolume.h>

namespace vshi {

namespace {

// OpenVDB asks at every polygon, on threads of its own choice; the callback is asked at most every 20 ms.
class Interrupter : public openvdb::util::NullInterrupter {
  public:
    Interrupter(Stage &stage_, double begin_, double end_) : stage(stage_), begin(begin_), end(end_) {
        give(this);
    }
    ~Interrupter() override { take(this); }

    bool wasInterrupted(int percent) override {
        take(this);
        if (percent >= 0) {
            stage.reach(begin + (end - begin) * 0.01 * percent);
        }
        if (!stop.load(std::memory_order_relaxed)) {
            const auto now = std::chrono::steady_clock::now().time_since_epoch().count();
            auto due = next.load(std::memory_order_relaxed);
            if (now >= due && next.compare_exchange_strong(due, now + period)) {
                stop = stage.cancelled();
            }
        }
        const bool stopped = stop;
        give(this);
        return stopped;
    }

  private:
    static constexpr std::chrono::steady_clock::rep period =
        std::chrono::steady_clock::duration(std::chrono::milliseconds(20)).count();
    Stage &stage;
    const double begin;
    const double end;
    std::atomic<bool> stop{false};
    std::atomic<std::chrono::steady_clock::rep> next{0};
};

using openvdb::Int32;
using Adapter = openvdb::tools::QuadAndTriangleDataAdapter<openvdb::Vec3s, openvdb::Vec4I>;

// The conversion constructs maps of its own, which takes voxels of some size (Lattice::transform()).
constexpr double SMALLEST_CONVERTED = 1e-4;

// The lattice scaled by a power of two to what can be converted: its distances are then as exact as its own.
Lattice scaled_up(const Lattice &lattice, double &scale) {
    for (scale = 1.0; lattice.voxel * scale < SMALLEST_CONVERTED;) {
        scale *= 2.0;
    }
    Lattice larger = lattice;
    larger.voxel *= scale;
    larger.translation *= scale;
    return larger;
}

void scale_values(FloatGrid &grid, float factor, Stage &stage) {
    std::vector<Leaf *> leaves;
    grid.tree().getNodes(leaves);
    stage.loop(leaves.size(), 64, 0.0, 0.0, [&](size_t i) {
        float *values = leaves[i]->buffer().data();
        for (openvdb::Index n = 0; n < Leaf::SIZE; ++n) {
            values[n] *= factor;
        }
    });
}

FloatGrid::Ptr convert(const Surface &surface, const Lattice &given, double half_width, int flags,
                       double begin, double end, Stage &stage) {
    namespace tools = openvdb::tools;
    const double middle = begin + 0.6 * (end - begin);
    double scale;
    const Lattice lattice = scaled_up(given, scale);
    Interrupter interrupter(stage, begin, middle);
    const openvdb::Int32Grid::Ptr nearest = openvdb::Int32Grid::create(Int32(openvdb::util::INVALID_IDX));
    FloatGrid::Ptr grid;
    stage.run([&] {
        const Adapter adapter(surface.points, surface.polygons);
        const float band = float(half_width + RIM);
        // Renormalising is for bumps of the distances that are measured again below.
        grid = tools::meshToVolume<FloatGrid>(
            static_cast<openvdb::util::NullInterrupter &>(interrupter), adapter, *lattice.transform(), band,
            band, flags | tools::DISABLE_RENORMALIZATION | tools::DISABLE_NARROW_BAND_TRIMMING,
            nearest.get());
    });
    stage.check();
    measure_again(*grid, *nearest, surface, lattice.voxel, middle, end, stage);
    if (scale != 1.0) {
        scale_values(*grid, float(1.0 / scale), stage);
        grid->setTransform(given.transform());
    }
    stage.run([&] { tools::changeLevelSetBackground(grid->tree(), float(half_width * given.voxel)); });
    return grid;
}

} // namespace

FloatGrid::Ptr fill_surface(const Surface &surface, const Lattice &lattice, double half_width, double begin,
                            double end, Stage &stage) {
    return convert(surface, lattice, half_width, 0, begin, end, stage);
}

FloatGrid::Ptr measure_surface(const Surface &surface, const Lattice &lattice, double half_width,
                               double begin, double end, Stage &stage) {
    return convert(surface, lattice, half_width, openvdb::tools::UNSIGNED_DISTANCE_FIELD, begin, end, stage);
}

} // namespace vshi
