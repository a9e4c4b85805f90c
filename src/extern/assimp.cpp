#include "extern/assimp.h"

#include "base/input.h"
#include "extern/guard.h"

#include <assimp/commonMetaData.h>
#include <assimp/config.h>
#include <assimp/scene.h>

#include <assimp/DefaultIOSystem.h>
#include <assimp/Importer.hpp>
#include <assimp/ProgressHandler.hpp>

#include <algorithm>
#include <cstring>
#include <memory>
#include <string>
#include <sys/stat.h>

namespace {

struct Cancelled : std::runtime_error {
    Cancelled() : std::runtime_error("cancelled") {}
};

// Hands Assimp's progress to the job; leaves the reader by an exception where the job is cancelled, which
// Assimp catches around its readers.
class Progress : public Assimp::ProgressHandler {
  public:
    Progress(vshi_job *job, size_t units) : job_(job), units_(units) {}

    bool Update(float) override { return !vshi_job_cancelled(job_); }

    void UpdateFileRead(int current, int all) override {
        const double fraction = all > 0 ? std::clamp(static_cast<double>(current) / all, 0.0, 1.0) : 0.0;
        const auto reached = std::max(done_, static_cast<size_t>(fraction * static_cast<double>(units_)));
        const size_t more = reached - done_;
        done_ = reached;
        // Assimp reports the end of a stage outside of what it catches; only its readers report a middle.
        if (vshi_job_advance(job_, more) && current > 0 && current < all) {
            throw Cancelled();
        }
    }

  private:
    vshi_job *job_;
    size_t units_;
    size_t done_ = 0;
};

// Opens what the file names, as a materials' file, but no pipe, and nothing outside of its folder.
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

// "a\nb" would break the one-line rule in a way that vshi_fail() can only patch with '?'.
std::string first_line(const char *text) {
    std::string line(text);
    line.erase(std::min(line.find_first_of("\r\n"), line.size()));
    return line.empty() ? "no reason given" : line;
}

} // namespace

struct vshi_import {
    Assimp::Importer importer;
    const aiScene *scene = nullptr;
};

vsh_result vshi_import_read(const char *path, bool outside, vshi_job *job, size_t units, vshi_import **import,
                            vsh_error *error) {
    *import = nullptr;
    return vshi::guard(error, VSH_ERROR_READ, path, [&]() -> vsh_result {
        auto reader = std::make_unique<vshi_import>();
        // Files that hold bones only would get a made-up mesh of them.
        reader->importer.SetPropertyBool(AI_CONFIG_IMPORT_NO_SKELETON_MESHES, true);
        reader->importer.SetProgressHandler(new Progress(job, units)); // the importer deletes it
        auto *const files = new Beside(path, outside);
        reader->importer.SetIOHandler(files); // as it does this
        reader->scene = reader->importer.ReadFile(path, 0);
        if (vshi_job_cancelled(job)) {
            return vshi_job_fail_cancelled(job, error);
        }
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
        *import = reader.release();
        return VSH_OK;
    });
}

double vshi_import_unit(const vshi_import *import) {
    static const double metres_a_centimetre = 0.01;
    const aiMetadata *facts = import->scene->mMetaData;
    aiString format;
    float centimetres = 1.0F; // what FBX is in where it says nothing
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

const aiScene *vshi_import_scene(const vshi_import *import) {
    return import->scene;
}

float vshi_import_opacity(const aiScene *scene, unsigned material) {
    float opacity = 1.0F;
    scene->mMaterials[material]->Get(AI_MATKEY_OPACITY, opacity);
    return opacity;
}

bool vshi_import_material_name(const aiScene *scene, unsigned material, aiString *name) {
    return scene->mMaterials[material]->Get(AI_MATKEY_NAME, *name) == aiReturn_SUCCESS && name->length > 0;
}

void vshi_import_free(vshi_import *import) {
    delete import;
}
