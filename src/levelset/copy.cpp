// A dense copy of a grid of a file: its values, and which of them are active.
#include "base/try.h"
#include "levelset/file.h"
#include "levelset/serve.h"

#include <cstring>
#include <memory>
#include <openvdb/tools/Dense.h>
#include <vdbshade/voxels.h>
#include <vector>

namespace vshi {

namespace {

using Dense = openvdb::tools::Dense<float, openvdb::tools::LayoutXYZ>; // x fastest, as in pictures

struct Copy {
    const openvdb::CoordBBox &box;
    float *values;
    float *active;

    template <typename GridType> void operator()(const GridType &grid) const {
        const auto &tree = grid.constTree();
        if constexpr (std::is_same_v<GridType, openvdb::MaskGrid>) {
            if (values != nullptr) {
                copy_active(tree, values);
            }
        } else if (values != nullptr) {
            Dense dense(box, values);
            openvdb::tools::copyToDense(tree, dense, true);
        }
        if (active != nullptr) {
            copy_active(tree, active);
        }
    }

    template <typename Tree> void copy_active(const Tree &tree, float *to) const {
        const openvdb::BoolTree topology(tree, false, true, openvdb::TopologyCopy());
        Dense dense(box, to);
        openvdb::tools::copyToDense(topology, dense, true);
    }
};

// What is to be copied: a box of a grid.
struct Wanted {
    const char *path, *name;
    int32_t low[3], size[3];
};

vsh_result check(const Wanted &wanted, vsh_error *error) {
    const int32_t *index_min = wanted.low, *size = wanted.size;
    double count = 1.0;
    for (int axis = 0; axis < 3; ++axis) {
        if (size[axis] < 1 || int64_t(index_min[axis]) + size[axis] - 1 > INT32_MAX) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "copy: %d voxels from %d on along %c", size[axis],
                             index_min[axis], "xyz"[axis]);
        }
        count *= double(size[axis]);
    }
    if (count > double(INT32_MAX)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "copy of %d × %d × %d voxels: expected up to 2^31 - 1",
                         size[0], size[1], size[2]);
    }
    return VSH_OK;
}

size_t count_of(const Wanted &wanted) {
    return size_t(wanted.size[0]) * size_t(wanted.size[1]) * size_t(wanted.size[2]);
}

void copy_here(const Wanted &wanted, const vsh_run &run, float *values, float *active, vsh_error *error) {
    Stage stage(run, "load", error);
    stage.check();
    const openvdb::GridBase::Ptr grid = read_numbers(wanted.path, wanted.name, run, error);
    stage.check();
    const openvdb::Coord low(wanted.low), size(wanted.size);
    const openvdb::CoordBBox box(low, low + size - openvdb::Coord(1));
    grid->apply<NumberGrids>(Copy{box, values, active});
}

// The same by run.reader.
void copy_there(const Wanted &wanted, const vsh_run &run, float *values, float *active, vsh_error *error) {
    const std::unique_ptr<vshi_job, void (*)(vshi_job *)> job(vshi_job_begin(&run, "load", 1), vshi_job_end);
    if (job == nullptr) {
        throw std::bad_alloc();
    }
    const auto request = std::make_unique<vshi_exchange>();
    vshi_answer answer;
    require(vshi_exchange_begin(request.get(), VSHI_READ_COPY, wanted.path, &run, error));
    vshi_encode_text(&request->encoder, wanted.name);
    vshi_encode_array(&request->encoder, wanted.low, 3, sizeof wanted.low[0]);
    vshi_encode_array(&request->encoder, wanted.size, 3, sizeof wanted.size[0]);
    vshi_encode_count(&request->encoder, values != nullptr);
    vshi_encode_count(&request->encoder, active != nullptr);
    require(vshi_exchange_send_job(request.get(), job.get(), 1, &answer, error));
    const std::unique_ptr<vshi_answer, void (*)(vshi_answer *)> owner(&answer, vshi_answer_free);
    const size_t count = count_of(wanted);
    for (float *to : {values, active}) {
        const void *from = to != nullptr ? vshi_decode_array(&answer.payload, count, sizeof *to) : nullptr;
        if (from != nullptr) {
            std::memcpy(to, from, count * sizeof *to);
        }
    }
    if (!vshi_decoder_ends(&answer.payload)) {
        throw Failure{vshi_answer_fail(wanted.path, "the copy's size", error)};
    }
}

} // namespace

} // namespace vshi

vsh_result vshi_serve_copy(const char *path, vshi_decoder *request, const vsh_run *run, vshi_encoder *payload,
                           vsh_error *error) {
    return vshi::guard(error, VSH_ERROR_READ, path, [&]() -> vsh_result {
        vshi::initialize();
        vshi::Wanted wanted{path, vshi_decode_text(request, false), {}, {}};
        for (int32_t *to : {wanted.low, wanted.size}) {
            const void *from = vshi_decode_array(request, 3, sizeof *to);
            if (from != nullptr) {
                std::memcpy(to, from, 3 * sizeof *to);
            }
        }
        const bool has[2] = {vshi_decode_count(request, 1) != 0, vshi_decode_count(request, 1) != 0};
        VSHI_TRY(vshi_decoder_ends(request) ? vshi::check(wanted, error)
                                            : vshi_fail(error, VSH_ERROR_INTERNAL,
                                                        "%s: the request to its reader does not hold", path));
        std::vector<float> arrays[2];
        for (int i = 0; i < 2; ++i) {
            arrays[i].resize(has[i] ? vshi::count_of(wanted) : 0);
        }
        vshi::copy_here(wanted, *run, has[0] ? arrays[0].data() : nullptr,
                        has[1] ? arrays[1].data() : nullptr, error);
        for (const std::vector<float> &array : arrays) {
            vshi_encode_array(payload, array.data(), array.size(), sizeof(float));
        }
        return VSH_OK;
    });
}

vsh_result vsh_vdb_copy(const char *path, const char *name, const int32_t index_min[3], const int32_t size[3],
                        const vsh_run *run, float *values, float *active, vsh_error *error) {
    VSHI_NEEDS(path);
    VSHI_NEEDS(index_min);
    VSHI_NEEDS(size);
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    return vshi::guard(error, VSH_ERROR_READ, path, [&]() -> vsh_result {
        vshi::initialize();
        const vshi::Wanted wanted{
            path, name, {index_min[0], index_min[1], index_min[2]}, {size[0], size[1], size[2]}};
        const vsh_result checked = vshi::check(wanted, error);
        if (checked == VSH_OK) {
            (full.reader != nullptr ? vshi::copy_there : vshi::copy_here)(wanted, full, values, active,
                                                                          error);
        }
        return checked;
    });
}
