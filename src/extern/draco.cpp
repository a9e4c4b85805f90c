#include "extern/draco.h"

#include "extern/guard.h"

#include <draco/compression/decode.h>

#include <memory>

struct vshi_draco {
    std::unique_ptr<draco::Mesh> mesh;
};

vsh_result vshi_draco_decode(const unsigned char *bytes, size_t size, const char *what, vshi_draco **mesh,
                             vsh_error *error) {
    *mesh = nullptr;
    return vshi::guard(error, VSH_ERROR_INPUT, what, [&]() -> vsh_result {
        draco::DecoderBuffer buffer;
        buffer.Init(reinterpret_cast<const char *>(bytes), size);
        draco::Decoder decoder;
        auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
        if (!decoded.ok()) {
            return vshi_fail(error, VSH_ERROR_INPUT, "%s: its Draco data is damaged: %s", what,
                             decoded.status().error_msg());
        }
        auto made = std::make_unique<vshi_draco>();
        made->mesh = std::move(decoded).value();
        *mesh = made.release();
        return VSH_OK;
    });
}

size_t vshi_draco_vertex_count(const vshi_draco *mesh) {
    return mesh->mesh->num_points();
}

size_t vshi_draco_triangle_count(const vshi_draco *mesh) {
    return mesh->mesh->num_faces();
}

void vshi_draco_indices(const vshi_draco *mesh, uint32_t *indices) {
    const uint32_t count = mesh->mesh->num_faces();
    for (uint32_t f = 0; f < count; ++f) {
        const draco::Mesh::Face &face = mesh->mesh->face(draco::FaceIndex(f));
        for (int k = 0; k < 3; ++k) {
            indices[3 * static_cast<size_t>(f) + k] = face[k].value();
        }
    }
}

namespace {

template <typename T> bool elements(const vshi_draco *mesh, uint32_t id, int components, T *values) {
    const draco::PointAttribute *attribute = mesh->mesh->GetAttributeByUniqueId(id);
    if (attribute == nullptr || attribute->num_components() != components) {
        return false;
    }
    const uint32_t count = mesh->mesh->num_points();
    for (uint32_t v = 0; v < count; ++v) {
        const draco::AttributeValueIndex index = attribute->mapped_index(draco::PointIndex(v));
        if (index.value() >= attribute->size() ||
            !attribute->ConvertValue(index, static_cast<int8_t>(components),
                                     values + components * static_cast<size_t>(v))) {
            return false;
        }
    }
    return true;
}

} // namespace

bool vshi_draco_attribute(const vshi_draco *mesh, uint32_t id, int components, float *values) {
    return elements(mesh, id, components, values);
}

bool vshi_draco_elements(const vshi_draco *mesh, uint32_t id, int type, int components, void *values) {
    switch (type) {
    case VSHI_DRACO_BYTE:
        return elements(mesh, id, components, static_cast<int8_t *>(values));
    case VSHI_DRACO_UBYTE:
        return elements(mesh, id, components, static_cast<uint8_t *>(values));
    case VSHI_DRACO_SHORT:
        return elements(mesh, id, components, static_cast<int16_t *>(values));
    case VSHI_DRACO_USHORT:
        return elements(mesh, id, components, static_cast<uint16_t *>(values));
    case VSHI_DRACO_UINT:
        return elements(mesh, id, components, static_cast<uint32_t *>(values));
    case VSHI_DRACO_FLOAT:
        return elements(mesh, id, components, static_cast<float *>(values));
    default:
        return false;
    }
}

void vshi_draco_free(vshi_draco *mesh) {
    delete mesh;
}
