// The module of importers, Assimp and Draco. Each file gets its own importer of Assimp's C++ API: the C API
// keeps the last error in one global string, shows no progress and cannot be stopped.
#include "io/model/importers.h"

#include "base/file.h"
#include "base/guard.h"

#include <assimp/commonMetaData.h>
#include <assimp/config.h>
#include <assimp/scene.h>

#include <assimp/DefaultIOSystem.h>
#include <assimp/Importer.hpp>
#include <assimp/ProgressHandler.hpp>

#include <draco/compression/decode.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <string>
#include <sys/stat.h>

namespace {

struct Cancelled : std::runtime_error {
    Cancelled() : std::runtime_error("cancelled") {}
};

// Passes Assimp's progress to the job. If the job is cancelled, throws: Assimp catches exceptions of its
// readers.
class Progress : public Assimp::ProgressHandler {
  public:
    Progress(vshi_job *job, size_t units) : job_(job), units_(units) {}

    bool Update(float) override { return !vshi_job_cancelled(job_); }

    void UpdateFileRead(int current, int all) override {
        const double fraction = all > 0 ? std::clamp(static_cast<double>(current) / all, 0.0, 1.0) : 0.0;
        const auto reached = std::max(done_, static_cast<size_t>(fraction * static_cast<double>(units_)));
        const size_t more = reached - done_;
        done_ = reached;
        // Assimp catches exceptions in the middle of a stage only, in its readers.
        if (vshi_job_advance(job_, more) && current > 0 && current < all) {
            throw Cancelled();
        }
    }

  private:
    vshi_job *job_;
    size_t units_;
    size_t done_ = 0;
};

// Opens files that the model names, as its materials, but no pipe, and nothing outside of its folder.
class Beside : public Assimp::DefaultIOSystem {
  public:
    Beside(const char *model, bool outside) : model_(model), outside_(outside) {}

    bool Exists(const char *path) const override {
        struct stat status;
        return ::stat(path, &status) == 0 && S_ISREG(status.st_mode);
    }

    Assimp::IOStream *Open(const char *path, const char *mode) override {
        struct stat status;
        if (::stat(path, &status) == 0 && !S_ISREG(status.st_mode)) {
            return nullptr;
        }
        if (!outside_ && model_ != path && !vshi_input_is_beside(model_.c_str(), path)) {
            refused_ = path;
            return nullptr;
        }
        return DefaultIOSystem::Open(path, mode);
    }

    const std::string &refused() const { return refused_; }

  private:
    std::string model_, refused_;
    bool outside_;
};

// Assimp's reasons may have several lines; messages have one.
std::string first_line(const char *text) {
    std::string line(text);
    line.erase(std::min(line.find_first_of("\r\n"), line.size()));
    return line.empty() ? "no reason given" : line;
}

struct Import : vshi_import {
    Assimp::Importer importer;
};

double unit_of(const aiScene *scene) {
    static const double metres_a_centimetre = 0.01;
    const aiMetadata *facts = scene->mMetaData;
    aiString format;
    float centimetres = 1.0F; // the default of FBX
    if (facts == nullptr || !facts->Get(AI_METADATA_SOURCE_FORMAT, format)) {
        return 0.0;
    }
    const std::string name = format.C_Str();
    if (name.find("FBX") != std::string::npos) {
        facts->Get("UnitScaleFactor", centimetres);
        return centimetres > 0.0F && centimetres < 1e12F
                   ? static_cast<double>(centimetres) * metres_a_centimetre
                   : metres_a_centimetre;
    }
    return 0.0;
}

vsh_result read_import(const char *path, bool outside, vshi_job *job, size_t units, vshi_import **import,
                       vsh_error *error) {
    *import = nullptr;
    return vshi::guard(error, VSH_ERROR_READ, path, [&]() -> vsh_result {
        auto reader = std::make_unique<Import>();
        // Otherwise Assimp makes a mesh of bones in files without meshes.
        reader->importer.SetPropertyBool(AI_CONFIG_IMPORT_NO_SKELETON_MESHES, true);
        reader->importer.SetProgressHandler(new Progress(job, units)); // the importer deletes it
        auto *const files = new Beside(path, outside);
        reader->importer.SetIOHandler(files); // and deletes this
        reader->scene = reader->importer.ReadFile(path, 0);
        VSHI_TRY(vshi_job_check(job, error));
        if (!files->refused().empty()) {
            return vshi_fail(
                error, VSH_ERROR_INPUT,
                "%s: names the file '%s' outside of its folder, where nothing is read of a model; "
                "--allow-outside (vsh_run.allow_outside) reads it",
                path, files->refused().c_str());
        }
        if (reader->scene == nullptr) {
            return vshi_fail(error, VSH_ERROR_READ, "%s: damaged or cut short, or not as its format says: %s",
                             path, first_line(reader->importer.GetErrorString()).c_str());
        }
        reader->unit = unit_of(reader->scene);
        *import = reader.release();
        return VSH_OK;
    });
}

void free_import(vshi_import *import) {
    delete static_cast<Import *>(import);
}

float opacity_of(const aiScene *scene, unsigned material) {
    float opacity = 1.0F;
    scene->mMaterials[material]->Get(AI_MATKEY_OPACITY, opacity);
    return opacity;
}

bool material_name(const aiScene *scene, unsigned material, aiString *name) {
    return scene->mMaterials[material]->Get(AI_MATKEY_NAME, *name) == aiReturn_SUCCESS && name->length > 0;
}

struct Draco : vshi_draco {
    std::unique_ptr<draco::Mesh> mesh;
};

const draco::Mesh &mesh_of(const vshi_draco *mesh) {
    return *static_cast<const Draco *>(mesh)->mesh;
}

vsh_result draco_decode(const unsigned char *bytes, size_t size, const char *what, vshi_draco **mesh,
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
        auto made = std::make_unique<Draco>();
        made->mesh = std::move(decoded).value();
        made->vertex_count = made->mesh->num_points();
        made->triangle_count = made->mesh->num_faces();
        *mesh = made.release();
        return VSH_OK;
    });
}

void draco_free(vshi_draco *mesh) {
    delete static_cast<Draco *>(mesh);
}

void draco_indices(const vshi_draco *mesh, uint32_t *indices) {
    for (uint32_t f = 0; f < mesh->triangle_count; ++f) {
        const draco::Mesh::Face &face = mesh_of(mesh).face(draco::FaceIndex(f));
        for (int k = 0; k < 3; ++k) {
            indices[3 * static_cast<size_t>(f) + k] = face[k].value();
        }
    }
}

template <typename T> bool elements(const vshi_draco *mesh, uint32_t id, int components, T *values) {
    const draco::PointAttribute *attribute = mesh_of(mesh).GetAttributeByUniqueId(id);
    if (attribute == nullptr || attribute->num_components() != components) {
        return false;
    }
    for (uint32_t v = 0; v < mesh->vertex_count; ++v) {
        const draco::AttributeValueIndex index = attribute->mapped_index(draco::PointIndex(v));
        if (index.value() >= attribute->size() ||
            !attribute->ConvertValue(index, static_cast<int8_t>(components),
                                     values + components * static_cast<size_t>(v))) {
            return false;
        }
    }
    return true;
}

bool draco_elements(const vshi_draco *mesh, uint32_t id, int type, int components, void *values) {
    switch (type) {
    case VSHI_GLTF_BYTE:
        return elements(mesh, id, components, static_cast<int8_t *>(values));
    case VSHI_GLTF_UBYTE:
        return elements(mesh, id, components, static_cast<uint8_t *>(values));
    case VSHI_GLTF_SHORT:
        return elements(mesh, id, components, static_cast<int16_t *>(values));
    case VSHI_GLTF_USHORT:
        return elements(mesh, id, components, static_cast<uint16_t *>(values));
    case VSHI_GLTF_UINT:
        return elements(mesh, id, components, static_cast<uint32_t *>(values));
    case VSHI_GLTF_FLOAT:
        return elements(mesh, id, components, static_cast<float *>(values));
    default:
        return false;
    }
}

} // namespace

// The module shows this symbol only (module.map).
const vshi_importers_table vshi_importers_module = {VSHI_VERSION, read_import,   free_import,
                                                    opacity_of,   material_name, draco_decode,
                                                    draco_free,   draco_indices, draco_elements};

// For the static library and for tests; the shared library has importers.c.
vsh_result vshi_importers_load(vsh_error *) {
    return VSH_OK;
}

const vshi_importers_table *vshi_importers() {
    return &vshi_importers_module;
}
