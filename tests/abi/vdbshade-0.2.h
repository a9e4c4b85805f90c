/* The interface of libvdbshade 0.2: made by tools/abi --update. */
#include <stddef.h>
#include <stdint.h>
       const char *vsh_version(void);
typedef int32_t vsh_result;
enum {
    VSH_OK = 0,
    VSH_ERROR_ARGUMENT = 1,
    VSH_ERROR_INPUT = 2,
    VSH_ERROR_READ = 3,
    VSH_ERROR_WRITE = 4,
    VSH_ERROR_LIMIT = 5,
    VSH_ERROR_MEMORY = 6,
    VSH_ERROR_CANCELLED = 7,
    VSH_ERROR_UNSUPPORTED = 8,
    VSH_ERROR_INTERNAL = 9
};
 const char *vsh_result_name(vsh_result result);
typedef struct vsh_error {
    vsh_result code;
    char message[1020];
} vsh_error;
 int32_t vsh_struct_init(const char *name, void *made, size_t size);
typedef struct vsh_attribute {
    const char *name;
    const char *value;
} vsh_attribute;
typedef int32_t vsh_progress_fn(void *user, const char *stage, double fraction);
typedef void vsh_warning_fn(void *user, const char *message);
enum {
    VSH_ISA_BEST = 0,
    VSH_ISA_BASE = 1,
    VSH_ISA_AVX2 = 2,
    VSH_ISA_AVX512 = 3
};
 int32_t vsh_isa(const char *name);
 const char *vsh_isa_name(int32_t isa);
 int32_t vsh_isa_available(int32_t isa);
typedef struct vsh_run {
    size_t struct_size;
    int32_t threads;
    uint64_t memory_limit;
    vsh_progress_fn *progress;
    vsh_warning_fn *warning;
    void *user;
    int32_t isa;
    const char *reader;
    double reader_seconds;
    int32_t confined;
    int32_t allow_outside;
    uint64_t memory_held;
} vsh_run;
enum { VSH_MAX_UV_SETS = 8 };
enum {
    VSH_SOLIDITY_AUTO,
    VSH_SOLIDITY_SOLID,
    VSH_SOLIDITY_SHELL,
    VSH_SOLIDITY_INWARD
};
enum {
    VSH_ALPHA_OPAQUE = 0,
    VSH_ALPHA_MASKED = 1,
    VSH_ALPHA_BLENDED = 2
};
typedef struct vsh_mesh {
    const char *name;
    const float *positions;
    const float *normals;
    const float *uvs;
    const uint32_t *indices;
    size_t vertex_count;
    size_t triangle_count;
    const double *transform;
    const char *object_name;
    uint32_t object;
    int32_t solidity;
    const struct vsh_checked_mesh *checked;
    int32_t alpha;
} vsh_mesh;
 int32_t vsh_mesh_matches(const vsh_mesh *mesh, const char *pattern);
typedef struct vsh_mesh_report {
    size_t degenerate_triangles;
    size_t open_edges;
    size_t flipped_edges;
    double area;
    double bounds_min[3];
    double bounds_max[3];
} vsh_mesh_report;
 vsh_result vsh_mesh_check_sized(const vsh_mesh *mesh, vsh_mesh_report *report, size_t report_size,
                                        vsh_error *error);
typedef struct vsh_model vsh_model;
 vsh_result vsh_model_read(const char *path, const vsh_run *run, vsh_model **model, vsh_error *error);
 void vsh_model_free(vsh_model *model);
 size_t vsh_model_mesh_count(const vsh_model *model);
 double vsh_model_unit(const vsh_model *model);
 double vsh_unit(const char *name);
 int32_t vsh_model_uv_sets(const vsh_model *model, size_t index);
enum {
    VSH_WRAP_REPEAT = 0,
    VSH_WRAP_MIRROR = 1,
    VSH_WRAP_CLAMP = 2
};
typedef struct vsh_model_material {
    const char *name;
    int32_t alpha;
    int32_t double_sided;
    double alpha_cutoff;
    double base_alpha;
    int32_t uv_set;
    int32_t wrap[2];
    double uv_transform[6];
    const void *image;
    size_t image_size;
    const char *image_path;
} vsh_model_material;
 size_t vsh_model_material_count(const vsh_model *model);
 void vsh_model_get_material_sized(const vsh_model *model, size_t index, vsh_model_material *material,
                                          size_t material_size);
 int32_t vsh_model_mesh_material(const vsh_model *model, size_t index);
enum {
    VSH_MODEL_LIGHT_DIRECTIONAL = 0,
    VSH_MODEL_LIGHT_POINT = 1,
    VSH_MODEL_LIGHT_SPOT = 2
};
typedef struct vsh_model_light {
    const char *name;
    int32_t type;
    double position[3];
    double direction[3];
    double color[3];
    double intensity;
    double range;
    double inner_angle;
    double outer_angle;
} vsh_model_light;
 size_t vsh_model_light_count(const vsh_model *model);
 void vsh_model_get_light_sized(const vsh_model *model, size_t index, vsh_model_light *light,
                                       size_t light_size);
 vsh_mesh vsh_model_mesh(const vsh_model *model, size_t index, int32_t uv_set);
enum {
    VSH_LIGHT_DIRECTIONAL = 0,
    VSH_LIGHT_SPHERE = 1,
    VSH_LIGHT_SPOT = 2,
    VSH_LIGHT_RECTANGLE = 3
};
enum {
    VSH_FALLOFF_NONE = 0,
    VSH_FALLOFF_INVERSE_SQUARE = 1,
    VSH_FALLOFF_QUADRATIC = 2
};
typedef struct vsh_light {
    int32_t type;
    int32_t falloff;
    double direction[3];
    double position[3];
    double angle;
    double radius;
    double axis[3];
    double inner_angle;
    double outer_angle;
    double reach;
    double color[3];
    char name[64];
    double edge_u[3];
    double edge_v[3];
    int32_t two_sided;
} vsh_light;
 vsh_result vsh_light_check(const vsh_light *light, vsh_error *error);
 void vsh_light_text(const vsh_light *light, char *text, size_t size);
enum {
    VSH_SHADOW_HARD = 0,
    VSH_SHADOW_CLASSIC = 1,
    VSH_SHADOW_PRACTICAL = 2,
    VSH_SHADOW_IMPROVED = 3,
    VSH_SHADOW_SMOOTH = 4,
    VSH_SHADOW_CONE = 5,
    VSH_SHADOW_RAYS = 6,
    VSH_SHADOW_ADAPTIVE =
        7,
    VSH_SHADOW_EXACT = 8,
    VSH_SHADOW_AUTO = 9
};
enum {
    VSH_AO_TAPS = 0,
    VSH_AO_CONES = 1,
    VSH_AO_RAYS = 2,
    VSH_AO_ADAPTIVE = 3,
    VSH_AO_EXACT = 4,
    VSH_AO_AUTO = 5
};
enum {
    VSH_METHOD_RAYS = 1,
    VSH_METHOD_KEEPS_ERROR = 2,
    VSH_METHOD_TRIANGLES = 4,
    VSH_METHOD_INNER = 8
};
enum {
    VSH_SAMPLER_SOBOL = 0,
    VSH_SAMPLER_WHITE = 1,
    VSH_SAMPLER_BLUE = 2
};
 int32_t vsh_shadow_method(const char *name);
 const char *vsh_shadow_method_name(int32_t method);
 int32_t vsh_ao_method(const char *name);
 const char *vsh_ao_method_name(int32_t method);
 int32_t vsh_sampler(const char *name);
 const char *vsh_sampler_name(int32_t sampler);
 uint32_t vsh_shadow_method_traits(int32_t method);
 uint32_t vsh_ao_method_traits(int32_t method);
 int32_t vsh_shadow_method_resolve(int32_t method, int32_t has_triangles);
 int32_t vsh_ao_method_resolve(int32_t method, int32_t has_triangles);
typedef struct vsh_outline vsh_outline;
typedef struct vsh_mask_options {
    size_t struct_size;
    double width;
    double height;
    double threshold;
    const char *channel;
    int32_t invert;
} vsh_mask_options;
 vsh_result vsh_outline_from_image(const char *path, const vsh_mask_options *options,
                                          const vsh_run *run, vsh_outline **outline, vsh_error *error);
enum { VSH_ALIGN_LEFT = 0, VSH_ALIGN_CENTER = 1, VSH_ALIGN_RIGHT = 2 };
 int32_t vsh_align(const char *name);
 const char *vsh_align_name(int32_t align);
typedef struct vsh_text_options {
    size_t struct_size;
    double height;
    double line_spacing;
    int32_t align;
} vsh_text_options;
 vsh_result vsh_outline_from_text(const char *text, const char *font, const vsh_text_options *options,
                                         const vsh_run *run, vsh_outline **outline, vsh_error *error);
 vsh_result vsh_outline_from_polygons(const double *points, const size_t *counts, size_t contour_count,
                                             const vsh_run *run, vsh_outline **outline, vsh_error *error);
typedef struct vsh_outline_instance {
    const vsh_outline *outline;
    const double *transform;
} vsh_outline_instance;
 vsh_result vsh_outline_unite(const vsh_outline_instance *instances, size_t instance_count,
                                     const vsh_run *run, vsh_outline **outline, vsh_error *error);
typedef struct vsh_outline_info {
    size_t contours;
    size_t points;
    double area;
    double bounds_min[2];
    double bounds_max[2];
    uint64_t bytes;
} vsh_outline_info;
 void vsh_outline_get_info_sized(const vsh_outline *outline, vsh_outline_info *info, size_t info_size);
 const double *vsh_outline_contour(const vsh_outline *outline, size_t index, size_t *count);
 double vsh_outline_distance(const vsh_outline *outline, const double point[2]);
 void vsh_outline_free(vsh_outline *outline);
enum {
    VSH_SDF_SPHERE = 0,
    VSH_SDF_BOX = 1,
    VSH_SDF_TORUS = 2,
    VSH_SDF_PLANE = 3,
    VSH_SDF_CAPSULE = 4,
    VSH_SDF_CYLINDER = 5,
    VSH_SDF_CONE = 6,
    VSH_SDF_UNION = 7,
    VSH_SDF_INTERSECTION = 8,
    VSH_SDF_SUBTRACTION = 9,
    VSH_SDF_SMOOTH_UNION = 10
};
typedef struct vsh_sdf_node {
    int32_t shape;
    int32_t left;
    int32_t right;
    double size[3];
    double radius;
    double minor_radius;
    double rounding;
    double smoothing;
    double scale;
    double rotation[4];
    double translation[3];
} vsh_sdf_node;
typedef struct vsh_sdf {
    const vsh_sdf_node *nodes;
    size_t node_count;
} vsh_sdf;
 vsh_result vsh_sdf_check(const vsh_sdf *sdf, vsh_error *error);
 double vsh_sdf_distance(const vsh_sdf *sdf, const double position[3]);
 void vsh_sdf_bounds(const vsh_sdf *sdf, double bounds_min[3], double bounds_max[3]);
typedef struct vsh_grid vsh_grid;
typedef struct vsh_grid_options {
    size_t struct_size;
    double voxel_size;
    int32_t resolution;
    double half_width;
    double shell_thickness;
} vsh_grid_options;
 vsh_result vsh_grid_from_meshes(const vsh_mesh *meshes, size_t mesh_count,
                                        const vsh_grid_options *options, const vsh_run *run, vsh_grid **grid,
                                        vsh_error *error);
 vsh_result vsh_grid_from_sdf(const vsh_sdf *sdf, const vsh_grid_options *options, const vsh_run *run,
                                     vsh_grid **grid, vsh_error *error);
 vsh_result vsh_grid_from_outline(const vsh_outline *outline, double thickness,
                                         const double *transform, const vsh_grid_options *options,
                                         const vsh_run *run, vsh_grid **grid, vsh_error *error);
typedef double vsh_distance_fn(void *user, const double position[3]);
typedef struct vsh_distance {
    vsh_distance_fn *distance;
    void *user;
    double lipschitz;
    int32_t exact;
    double bounds_min[3];
    double bounds_max[3];
} vsh_distance;
 vsh_result vsh_grid_from_distance(const vsh_distance *field, const vsh_grid_options *options,
                                          const vsh_run *run, vsh_grid **grid, vsh_error *error);
 vsh_result vsh_grid_read(const char *path, const char *name, const vsh_run *run, vsh_grid **grid,
                                 vsh_error *error);
 vsh_result vsh_grid_write(const vsh_grid *grid, const char *path, const char *name,
                                  const vsh_attribute *attributes, size_t attribute_count, vsh_error *error);
typedef struct vsh_grid_instance {
    const vsh_grid *grid;
    const double *transform;
} vsh_grid_instance;
 vsh_result vsh_grid_unite(const vsh_grid_instance *instances, size_t instance_count,
                                  const vsh_grid_options *options, const vsh_run *run, vsh_grid **grid,
                                  vsh_error *error);
typedef struct vsh_grid_info {
    double voxel_size;
    double half_width;
    double bounds_min[3];
    double bounds_max[3];
    double shell_thickness;
    uint64_t active_voxels;
    uint64_t bytes;
    int32_t index_min[3];
    int32_t index_max[3];
    double transform[12];
} vsh_grid_info;
 void vsh_grid_get_info_sized(const vsh_grid *grid, vsh_grid_info *info, size_t info_size);
 vsh_result vsh_grid_copy(const vsh_grid *grid, const int32_t index_min[3], const int32_t size[3],
                                 float *values, vsh_error *error);
 void vsh_grid_free(vsh_grid *grid);
 vsh_result vsh_grid_from_openvdb(const void *level_set, uint32_t version, uint32_t abi,
                                         const vsh_run *run, vsh_grid **grid, vsh_error *error);
 vsh_result vsh_grid_to_openvdb(const vsh_grid *grid, uint32_t version, uint32_t abi, void *level_set,
                                       vsh_error *error);
typedef struct vsh_vdb_entry {
    char name[128];
    char type[64];
    char grid_class[32];
    double voxel_size[3];
    double background;
    int32_t index_min[3];
    int32_t index_max[3];
    uint64_t active_voxels;
    uint64_t bytes;
    char problem[256];
    char attributes[8192];
} vsh_vdb_entry;
 vsh_result vsh_vdb_list_sized(const char *path, const vsh_run *run, vsh_vdb_entry *entries,
                                      size_t entries_size, size_t capacity, size_t *count, vsh_error *error);
typedef struct vsh_triangles vsh_triangles;
 int vsh_triangles_available(void);
 vsh_result vsh_triangles_create(const vsh_mesh *meshes, size_t mesh_count, const vsh_run *run,
                                        vsh_triangles **triangles, vsh_error *error);
 void vsh_triangles_free(vsh_triangles *triangles);
 uint64_t vsh_triangles_bytes(const vsh_triangles *triangles);
typedef struct vsh_solids vsh_solids;
 vsh_result vsh_solids_create(const vsh_sdf *sdfs, const double *transforms, size_t count,
                                     vsh_solids **solids, vsh_error *error);
 void vsh_solids_free(vsh_solids *solids);
 double vsh_solids_distance(const vsh_solids *solids, const double position[3]);
 vsh_result vsh_trace_shadow(const vsh_triangles *triangles, const vsh_solids *solids, size_t count,
                                    const double *positions, const float *normals, double lift,
                                    const vsh_light *light, int32_t rays, const vsh_run *run,
                                    float *visibility, vsh_error *error);
 vsh_result vsh_trace_ao(const vsh_triangles *triangles, const vsh_solids *solids, size_t count,
                                const double *positions, const float *normals, double lift, double distance,
                                int32_t rays, const vsh_run *run, float *ao, vsh_error *error);
typedef struct vsh_field vsh_field;
typedef struct vsh_field_options {
    size_t struct_size;
    double reach;
    int32_t surface;
} vsh_field_options;
 vsh_result vsh_field_create(const vsh_grid *grid, const vsh_field_options *options,
                                    const vsh_run *run, vsh_field **field, vsh_error *error);
 void vsh_field_free(vsh_field *field);
 void vsh_field_sample(const vsh_field *field, size_t count, const double *positions,
                              float *distances);
typedef struct vsh_field_info {
    double voxel_size;
    double reach;
    double bounds_min[3];
    double bounds_max[3];
    double shell_thickness;
    int32_t levels;
    uint64_t bricks;
    uint64_t bytes;
    uint64_t
        active_voxels;
} vsh_field_info;
 void vsh_field_get_info_sized(const vsh_field *field, vsh_field_info *info, size_t info_size);
typedef struct vsh_lost {
    double share;
    double thickness;
    uint64_t triangles;
} vsh_lost;
 vsh_result vsh_field_find_lost_sized(const vsh_field *field, const vsh_mesh *meshes,
                                             size_t mesh_count, const vsh_triangles *triangles,
                                             vsh_lost *lost, size_t lost_size, vsh_error *error);
enum { VSH_MAX_HEIGHTS_SIDE = 65536 };
typedef struct vsh_heights_source {
    const char *name;
    int32_t columns;
    int32_t rows;
    const float *values;
    double size[2];
    double height;
    double base;
    const double *transform;
} vsh_heights_source;
enum {
    VSH_HEIGHTS_SOLID = 0,
    VSH_HEIGHTS_SURFACE = 1
};
 vsh_result vsh_model_from_heights(const vsh_heights_source *source, int32_t what, const vsh_run *run,
                                          vsh_model **model, vsh_error *error);
typedef struct vsh_heights vsh_heights;
 vsh_result vsh_heights_create(const vsh_heights_source *source, const vsh_run *run,
                                      vsh_heights **heights, vsh_error *error);
 void vsh_heights_free(vsh_heights *heights);
typedef struct vsh_heights_info {
    int32_t columns;
    int32_t rows;
    double lowest;
    double highest;
    double bounds_min[3];
    double bounds_max[3];
    uint64_t bytes;
} vsh_heights_info;
 void vsh_heights_get_info_sized(const vsh_heights *heights, vsh_heights_info *info, size_t info_size);
typedef struct vsh_spheres vsh_spheres;
 vsh_result vsh_spheres_create(const double *spheres, size_t count, const double *transform,
                                      const vsh_run *run, vsh_spheres **made, vsh_error *error);
 void vsh_spheres_free(vsh_spheres *spheres);
typedef struct vsh_spheres_info {
    size_t count;
    double bounds_min[3];
    double bounds_max[3];
    uint64_t bytes;
} vsh_spheres_info;
 void vsh_spheres_get_info_sized(const vsh_spheres *spheres, vsh_spheres_info *info, size_t info_size);
 vsh_result vsh_spheres_read(const char *path, const vsh_run *run, double **spheres, size_t *count,
                                    vsh_error *error);
 void vsh_spheres_list_free(double *spheres);
enum {
    VSH_COMBINE_MULTIPLY = 0,
    VSH_COMBINE_MIN = 1
};
enum { VSH_MAX_LAYERS = 128 };
typedef struct vsh_layer {
    size_t struct_size;
    const vsh_field *field;
    int32_t method;
    int32_t combine;
    double softness;
    double remap[2];
    double start_offset;
    const vsh_triangles *triangles;
    const char *const *lights;
    size_t light_count;
    int32_t ao;
    const vsh_heights *heights;
    const vsh_spheres *spheres;
    const char *name;
} vsh_layer;
 int32_t vsh_combine(const char *name);
 const char *vsh_combine_name(int32_t combine);
typedef struct vsh_occluders vsh_occluders;
typedef struct vsh_occluders_options {
    size_t struct_size;
    double reach;
    int32_t triangles;
    vsh_grid_options grid;
} vsh_occluders_options;
 vsh_result vsh_occluders_create(const vsh_mesh *meshes, size_t mesh_count,
                                        const vsh_occluders_options *options, const vsh_run *run,
                                        vsh_occluders **occluders, vsh_error *error);
 vsh_result vsh_occluders_from_grid(const vsh_grid *grid, const vsh_field_options *options,
                                           const vsh_run *run, vsh_occluders **occluders, vsh_error *error);
typedef struct vsh_occluder_parts {
    size_t struct_size;
    const vsh_field *field;
    const vsh_triangles *triangles;
    const vsh_layer
        *layers;
    size_t layer_count;
    const vsh_triangles *true_triangles;
    const vsh_solids *true_solids;
    double voxel_size;
} vsh_occluder_parts;
 vsh_result vsh_occluders_from_parts(const vsh_occluder_parts *parts, vsh_occluders **occluders,
                                            vsh_error *error);
 void vsh_occluders_free(vsh_occluders *occluders);
 void vsh_occluders_get_parts_sized(const vsh_occluders *occluders, vsh_occluder_parts *parts,
                                           size_t parts_size);
typedef struct vsh_occluders_info {
    double voxel_size;
    int32_t levels;
    size_t layer_count;
    uint64_t active_voxels;
    uint64_t grid_bytes;
    uint64_t bricks;
    uint64_t field_bytes;
    uint64_t triangles_bytes;
    int32_t has_triangles;
    double voxelize_s;
    double field_s;
    double triangles_s;
} vsh_occluders_info;
 void vsh_occluders_get_info_sized(const vsh_occluders *occluders, vsh_occluders_info *info,
                                          size_t info_size);
typedef struct vsh_points {
    size_t count;
    const double *positions;
    const float *normals;
    const uint32_t *texels;
} vsh_points;
typedef struct vsh_shade_stats {
    size_t struct_size;
    uint64_t marches;
    uint64_t samples;
    uint64_t skipped;
    uint64_t certified;
    uint64_t unfinished;
    uint64_t invalid;
    uint64_t beyond_reach;
    uint64_t rays;
    uint64_t refined;
    double square_error;
    double ao_square_error;
    double worst_error;
} vsh_shade_stats;
typedef struct vsh_shade_options {
    size_t struct_size;
    int32_t method;
    int32_t ao_method;
    int32_t ao_cones;
    int32_t max_steps;
    double ao_distance;
    double start_offset;
    double surface_offset;
    int32_t rays;
    int32_t sampler;
    int32_t frame;
    int32_t early_rays;
    double max_error;
    double jitter;
    double
        ao_up[3];
} vsh_shade_options;
 vsh_result vsh_shade_shadow(const vsh_occluders *occluders, const vsh_points *points,
                                    const vsh_light *light, const vsh_shade_options *options,
                                    const vsh_run *run, float *visibility, float *deviation,
                                    vsh_shade_stats *stats, vsh_error *error);
 vsh_result vsh_shade_ao(const vsh_occluders *occluders, const vsh_points *points,
                                const vsh_shade_options *options, const vsh_run *run, float *ao,
                                float *deviation, float *bent, vsh_shade_stats *stats, vsh_error *error);
enum {
    VSH_TINT_NONE = 0,
    VSH_TINT_QUADRATIC = 1,
    VSH_TINT_POWER = 2
};
typedef struct vsh_tint {
    int32_t type;
    double power[3];
} vsh_tint;
 void vsh_shade_tint(size_t count, const float *visibility, const vsh_tint *tint, float *rgb);
 int32_t vsh_tint_type(const char *name);
 const char *vsh_tint_type_name(int32_t type);
 vsh_result vsh_tint_check(const vsh_tint *tint, vsh_error *error);
 void vsh_shade_irradiance(const vsh_points *points, const float *shading_normals,
                                  const vsh_light *light, const float *visibility, float *irradiance);
enum { VSH_MAX_LIGHTMAP_SIZE = 65536 };
enum { VSH_PADDING_AUTO = -1 };
typedef struct vsh_lightmap_options {
    size_t struct_size;
    int32_t width;
    int32_t height;
    int32_t supersample;
    int32_t padding;
    vsh_shade_options shade;
    int32_t ao_spacing;
    int32_t tangents;
} vsh_lightmap_options;
typedef struct vsh_uv_report {
    size_t overlap_texels;
    size_t overlap_triangles;
    size_t outside_triangles;
    size_t degenerate_triangles;
    size_t other_texels;
    size_t other_mesh;
    size_t other_mesh_texels;
} vsh_uv_report;
typedef struct vsh_closeness {
    uint64_t texels;
    uint64_t mesh_texels;
    size_t mesh;
    double gap;
} vsh_closeness;
 vsh_result vsh_charts_closeness_sized(const vsh_mesh *meshes, size_t mesh_count, int32_t width,
                                              int32_t height, const vsh_run *run, vsh_closeness *found,
                                              size_t found_size, vsh_error *error);
typedef struct vsh_texels vsh_texels;
 vsh_result vsh_texels_create_sized(const vsh_mesh *meshes, size_t mesh_count,
                                           const vsh_lightmap_options *options, const vsh_run *run,
                                           vsh_uv_report *uv_reports, size_t uv_reports_size,
                                           vsh_texels **texels, vsh_error *error);
 void vsh_texels_free(vsh_texels *texels);
typedef struct vsh_texels_info {
    int32_t width;
    int32_t height;
    uint64_t covered;
    uint64_t samples;
    double bounds_min[3];
    double bounds_max[3];
    uint64_t bytes;
} vsh_texels_info;
 void vsh_texels_get_info_sized(const vsh_texels *texels, vsh_texels_info *info, size_t info_size);
typedef struct vsh_charts vsh_charts;
 vsh_result vsh_charts_create_sized(const vsh_mesh *meshes, size_t mesh_count,
                                           const vsh_lightmap_options *options, const vsh_run *run,
                                           vsh_uv_report *uv_reports, size_t uv_reports_size,
                                           vsh_charts **charts, vsh_error *error);
 void vsh_charts_free(vsh_charts *charts);
typedef struct vsh_charts_info {
    int32_t width;
    int32_t height;
    uint64_t covered;
    uint64_t samples;
    uint64_t bytes;
} vsh_charts_info;
 void vsh_charts_get_info_sized(const vsh_charts *charts, vsh_charts_info *info, size_t info_size);
 vsh_result vsh_charts_bounds(const vsh_charts *charts, const vsh_run *run, double bounds_min[3],
                                     double bounds_max[3], vsh_error *error);
enum { VSH_BAND_STEP = 8 };
 vsh_result vsh_texels_create_band(const vsh_charts *charts, int32_t first_row, int32_t rows,
                                          const vsh_run *run, vsh_texels **texels, vsh_error *error);
typedef struct vsh_texel_samples {
    size_t count;
    const double *positions;
    const float *normals;
    const float *geometric_normals;
    const uint32_t *texels;
} vsh_texel_samples;
 void vsh_texels_samples_sized(const vsh_texels *texels, vsh_texel_samples *samples,
                                      size_t samples_size);
enum { VSH_BENT_WORLD = 0, VSH_BENT_TANGENT = 1 };
 int32_t vsh_bent_space(const char *name);
 const char *vsh_bent_space_name(int32_t space);
enum {
    VSH_UP_NONE = 0,
    VSH_UP_X = 1,
    VSH_UP_Y = 2,
    VSH_UP_Z = 3,
    VSH_UP_MINUS_X = 4,
    VSH_UP_MINUS_Y = 5,
    VSH_UP_MINUS_Z = 6
};
 int32_t vsh_up(const char *name);
 const char *vsh_up_name(int32_t up);
typedef struct vsh_planes {
    int32_t invalid;
    int32_t sky;
} vsh_planes;
 int32_t vsh_planes_shaded(const vsh_planes *planes);
typedef struct vsh_lightmap {
    float *const *shadow;
    float *ao;
    float *irradiance;
    float *coverage;
    float *const *shadow_error;
    float *ao_error;
    float *bent;
    float *const *tint;
    vsh_tint tint_by;
    const double *ambient;
    int32_t bent_space;
    float *invalid;
    vsh_planes asked;
    float *sky;
} vsh_lightmap;
 uint64_t vsh_charts_band_bytes(const vsh_charts *charts, int32_t first_row, int32_t rows,
                                       const vsh_lightmap *lightmap, size_t light_count);
typedef struct vsh_bake_error {
    double values;
    double square_error;
    double held;
    double held_square_error;
    double worst;
} vsh_bake_error;
 double vsh_bake_error_rmse(const vsh_bake_error *error);
 double vsh_bake_error_field(const vsh_bake_error *error);
typedef struct vsh_bake_stats {
    size_t struct_size;
    uint64_t texels;
    uint64_t invalid_texels;
    uint64_t *invalid_by_mesh;
    vsh_shade_stats shade;
    uint64_t seen_texels;
    vsh_bake_error *errors;
} vsh_bake_stats;
 vsh_result vsh_bake_lightmap(const vsh_occluders *occluders, const vsh_texels *texels,
                                     const vsh_light *lights, size_t light_count,
                                     const vsh_shade_options *options, const vsh_run *run,
                                     const vsh_lightmap *lightmap, vsh_bake_stats *stats, vsh_error *error);
enum {
    VSH_SEAMS_DEFAULT = 0,
    VSH_SEAMS_KEEP = 1,
    VSH_SEAMS_FIX = 2
};
 int32_t vsh_seams(const char *name);
 const char *vsh_seams_name(int32_t seams);
typedef struct vsh_stitch_options {
    size_t struct_size;
    double max_change;
    double max_angle;
    double keep;
} vsh_stitch_options;
typedef struct vsh_stitch_report {
    uint64_t seams;
    uint64_t places;
    uint64_t crowded;
    uint64_t texels;
    double before;
    double after;
} vsh_stitch_report;
 vsh_result vsh_lightmap_stitch_sized(const vsh_charts *charts, const vsh_lightmap *lightmap,
                                             size_t light_count, const vsh_stitch_options *options,
                                             const vsh_run *run, vsh_stitch_report *report,
                                             size_t report_size, vsh_error *error);
enum { VSH_MAX_CHANNELS = 256, VSH_CHANNEL_NAME = 128 };
enum {
    VSH_CHANNEL_DATA = 0,
    VSH_CHANNEL_LIGHT = 1,
    VSH_CHANNEL_VECTOR = 2
};
typedef struct vsh_image {
    int32_t width;
    int32_t height;
    int32_t channel_count;
    const char *const *names;
    const float *const *planes;
    const int32_t *holds;
} vsh_image;
enum {
    VSH_COLOR_AUTO = 0,
    VSH_COLOR_LINEAR = 1,
    VSH_COLOR_SRGB = 2,
    VSH_COLOR_ENCODED = 3
};
 const char *vsh_color_space_name(int32_t color_space);
 double vsh_srgb_to_linear(double encoded);
typedef struct vsh_image_options {
    size_t struct_size;
    int32_t bits;
    const char *pack;
    const vsh_attribute *attributes;
    size_t attribute_count;
    int32_t color_space;
} vsh_image_options;
 vsh_result vsh_image_write(const char *path, const vsh_image *image, const vsh_image_options *options,
                                   vsh_error *error);
typedef struct vsh_image_writer vsh_image_writer;
 vsh_result vsh_image_writer_create(const char *path, const vsh_image *image,
                                           const vsh_image_options *options, vsh_image_writer **writer,
                                           vsh_error *error);
 vsh_result vsh_image_writer_add(vsh_image_writer *writer, int32_t rows, const float *const *planes,
                                        vsh_error *error);
typedef struct vsh_image_clipping {
    uint64_t texels;
    uint64_t clipped;
    float largest;
} vsh_image_clipping;
 vsh_result vsh_image_writer_get_clipping_sized(const vsh_image_writer *writer,
                                                       vsh_image_clipping *clipping, size_t clipping_size,
                                                       vsh_error *error);
 vsh_result vsh_image_writer_finish(vsh_image_writer *writer, vsh_error *error);
 void vsh_image_writer_abandon(vsh_image_writer *writer);
 uint64_t vsh_image_writer_bytes(const char *path, const vsh_image *image,
                                        const vsh_image_options *options);
 vsh_result vsh_image_check(const char *path, const vsh_image *image, const vsh_image_options *options,
                                   vsh_error *error);
 void vsh_image_default_pack(const vsh_image *image, char *text, size_t capacity);
typedef struct vsh_image_file vsh_image_file;
 vsh_result vsh_image_read(const char *path, const vsh_run *run, vsh_image_file **file,
                                  vsh_error *error);
 vsh_image vsh_image_view(const vsh_image_file *file);
 const vsh_attribute *vsh_image_attributes(const vsh_image_file *file, size_t *count);
 void vsh_image_free(vsh_image_file *file);
typedef struct vsh_lit_mesh {
    const float *uvs;
    const uint32_t *sources;
    const uint32_t *indices;
    const uint32_t
        *charts;
    size_t vertex_count;
    size_t triangle_count;
    uint32_t page;
    int32_t uv_set;
} vsh_lit_mesh;
enum {
    VSH_LIT_OCCLUSION = 0,
    VSH_LIT_LIGHTMAP = 1,
    VSH_LIT_PREVIEW = 2,
    VSH_LIT_PURPOSES = 3
};
typedef struct vsh_lit_image {
    int32_t purpose;
    uint32_t page;
    const void *png;
    size_t png_size;
    int32_t width, height;
    const float *const
        *channels;
    int32_t channel_count;
    int32_t bits;
    double intensity;
} vsh_lit_image;
enum {
    VSH_LIT_IMAGES_AUTO = 0,
    VSH_LIT_IMAGES_EMBED = 1,
    VSH_LIT_IMAGES_BESIDE = 2,
};
typedef struct vsh_lit_options {
    size_t struct_size;
    const uint32_t *chart_pages;
    size_t chart_count;
    const vsh_lit_image *images;
    size_t image_count;
    int32_t image_place;
} vsh_lit_options;
 vsh_result vsh_lit_write(const char *path, const vsh_model *model, const vsh_lit_mesh *meshes,
                                 const vsh_lit_options *options, const char *output, const vsh_run *run,
                                 vsh_error *error);
 int32_t vsh_lit_is_output(const char *path);
enum { VSH_MAX_PAGES = 1024, VSH_MAX_PAGE_SIZE = 65536 };
enum {
    VSH_UNWRAP_ALWAYS = 0,
    VSH_UNWRAP_KEEP = 1
};
typedef struct vsh_unwrap_options {
    size_t struct_size;
    int32_t width;
    int32_t height;
    int32_t max_pages;
    int32_t padding;
    double texels_per_unit;
    const double *density;
    double max_stretch;
    int32_t keep_uvs;
} vsh_unwrap_options;
typedef struct vsh_atlas_mesh {
    const float *uvs;
    const uint32_t *sources;
    const uint32_t *indices;
    const uint32_t *charts;
    size_t vertex_count;
    size_t triangle_count;
} vsh_atlas_mesh;
typedef struct vsh_atlas_chart {
    uint32_t page;
    uint32_t mesh;
    float stretch;
    int32_t min[2];
    int32_t max[2];
    double area;
} vsh_atlas_chart;
typedef struct vsh_atlas_info {
    uint64_t charts;
    uint32_t pages;
    int32_t width;
    int32_t height;
    double texels_per_unit;
    double covered;
    double stretch;
    double worst_stretch;
    uint64_t flat_triangles;
    uint64_t kept;
    uint64_t shared;
} vsh_atlas_info;
typedef struct vsh_atlas vsh_atlas;
 vsh_result vsh_unwrap(const vsh_mesh *meshes, size_t mesh_count, const vsh_unwrap_options *options,
                              const vsh_run *run, vsh_atlas **atlas, vsh_error *error);
 void vsh_atlas_free(vsh_atlas *atlas);
 vsh_result vsh_uvs_usable(const vsh_mesh *mesh, const vsh_run *run, int32_t *usable,
                                  vsh_error *error);
typedef struct vsh_uvs_measures {
    double texels_per_unit;
    double stretch;
} vsh_uvs_measures;
 vsh_result vsh_uvs_measure_sized(const vsh_mesh *mesh, int32_t width, int32_t height,
                                         vsh_uvs_measures *measures, size_t measures_size, vsh_error *error);
 size_t vsh_atlas_mesh_count(const vsh_atlas *atlas);
 size_t vsh_atlas_chart_count(const vsh_atlas *atlas);
 size_t vsh_atlas_page_count(const vsh_atlas *atlas);
 void vsh_atlas_get_info_sized(const vsh_atlas *atlas, vsh_atlas_info *info, size_t info_size);
 void vsh_atlas_mesh_view_sized(const vsh_atlas *atlas, size_t mesh, vsh_atlas_mesh *view,
                                       size_t view_size);
 void vsh_atlas_chart_view_sized(const vsh_atlas *atlas, size_t chart, vsh_atlas_chart *view,
                                        size_t view_size);
 const vsh_atlas_chart *vsh_atlas_charts(const vsh_atlas *atlas);
enum {
    VSH_CASTER_MESH = 0,
    VSH_CASTER_SDF = 1,
    VSH_CASTER_VDB = 2,
    VSH_CASTER_HEIGHTFIELD = 3,
    VSH_CASTER_SPHERES = 4,
    VSH_CASTER_MASK = 5,
    VSH_CASTER_TEXT = 6
};
typedef struct vsh_selection {
    const char *const *only;
    size_t only_count;
    const char *const *except;
    size_t except_count;
} vsh_selection;
typedef struct vsh_solidity_rule {
    const char *pattern;
    int32_t solidity;
} vsh_solidity_rule;
typedef struct vsh_caster {
    int32_t type;
    const char *path;
    const char *grid;
    vsh_sdf sdf;
    double transform[12];
    const char *layer;
    double size[2];
    double height;
    double base;
    int32_t direct;
    const double *spheres;
    size_t sphere_count;
    int32_t voxelised;
    vsh_mask_options mask;
    const char *text;
    vsh_text_options letters;
    double thickness;
    double color[3];
    vsh_selection objects;
    const vsh_solidity_rule *solidity;
    size_t solidity_count;
} vsh_caster;
typedef struct vsh_scene_layer {
    const char *name;
    double voxel_size;
    int32_t resolution;
    vsh_layer shade;
} vsh_scene_layer;
enum { VSH_RECEIVER_MESH = 0, VSH_RECEIVER_HEIGHTFIELD = 1 };
enum {
    VSH_RECEIVER_UNWRAP_DEFAULT = 0,
    VSH_RECEIVER_UNWRAP_NEVER = 1,
    VSH_RECEIVER_UNWRAP_AUTO =
        2,
    VSH_RECEIVER_UNWRAP_ALWAYS = 3
};
 int32_t vsh_receiver_unwrap(const char *name);
 const char *vsh_receiver_unwrap_name(int32_t unwrap);
typedef struct vsh_receiver {
    const char *path;
    double transform[12];
    int32_t uv_set;
    int32_t width;
    int32_t height;
    int32_t supersample;
    int32_t padding;
    int32_t ao_spacing;
    const char *output;
    int32_t bits;
    const char *pack;
    int32_t type;
    double extent[2];
    double relief;
    vsh_selection objects;
    int32_t partial;
    int32_t allow_overlap;
    int32_t color_space;
    int32_t unwrap;
    double texels_per_unit;
    int32_t pages;
    int32_t seams;
} vsh_receiver;
typedef struct vsh_scene {
    const vsh_caster *casters;
    size_t caster_count;
    const vsh_scene_layer *layers;
    size_t layer_count;
    const vsh_light *lights;
    size_t light_count;
    const vsh_receiver *receivers;
    size_t receiver_count;
    vsh_grid_options grid;
    vsh_shade_options shade;
    int32_t ao;
    int32_t bent;
    int32_t irradiance;
    vsh_tint tint;
    int32_t has_ambient;
    double ambient[3];
    vsh_planes planes;
    int32_t error;
    const vsh_solidity_rule *solidity;
    size_t solidity_count;
    double unit;
    int32_t voxels_named;
    int32_t cast_blended;
} vsh_scene;
 vsh_result vsh_scene_read(const char *path, const vsh_run *run, vsh_scene **scene, vsh_error *error);
 void vsh_scene_free(vsh_scene *scene);
 vsh_result vsh_lights_from_model(const vsh_model *model, double angle, double radius, double unit,
                                         vsh_light **lights, size_t *count, vsh_error *error);
 void vsh_lights_free(vsh_light *lights);
typedef struct vsh_assets vsh_assets;
 vsh_result vsh_assets_load(const vsh_scene *scene, const vsh_run *run, vsh_assets **assets,
                                   vsh_error *error);
 void vsh_assets_free(vsh_assets *assets);
 const vsh_mesh *vsh_assets_receiver(const vsh_assets *assets, size_t index, size_t *mesh_count);
 const vsh_mesh *vsh_assets_caster(const vsh_assets *assets, size_t index, size_t *mesh_count);
 const vsh_model *vsh_assets_receiver_model(const vsh_assets *assets, size_t index,
                                                   const size_t **numbers);
 vsh_result vsh_receiver_needs_unwrap(const vsh_receiver *receiver, const vsh_mesh *meshes,
                                             size_t count, const vsh_run *run, int32_t *needs,
                                             vsh_error *error);
 size_t vsh_assets_receiver_pages(const vsh_assets *assets, size_t index);
 const vsh_mesh *vsh_assets_receiver_page(const vsh_assets *assets, size_t index, size_t page,
                                                 size_t *first, size_t *mesh_count);
 const vsh_atlas *vsh_assets_receiver_atlas(const vsh_assets *assets, size_t index,
                                                   const size_t **numbers);
 const vsh_heights *vsh_assets_heights(const vsh_assets *assets, size_t index);
 const vsh_spheres *vsh_assets_spheres(const vsh_assets *assets, size_t index);
 vsh_result vsh_scene_casters(const vsh_scene *scene, const vsh_assets *assets, const vsh_run *run,
                                     vsh_grid **grid, vsh_error *error);
 vsh_result vsh_scene_layer_casters(const vsh_scene *scene, const vsh_assets *assets,
                                           const vsh_scene_layer *layer, const vsh_run *run, vsh_grid **grid,
                                           vsh_error *error);
 vsh_result vsh_scene_triangles(const vsh_scene *scene, const vsh_assets *assets,
                                       const vsh_scene_layer *layer, const vsh_run *run,
                                       vsh_triangles **triangles, vsh_error *error);
 int32_t vsh_scene_traceable(const vsh_scene *scene, const vsh_scene_layer *layer);
 int32_t vsh_scene_marches(const vsh_scene *scene, const vsh_scene_layer *layer);
enum { VSH_RESOLUTION_NAMED = -1 };
 int32_t vsh_scene_resolution(const vsh_scene *scene, const vsh_assets *assets,
                                     const vsh_scene_layer *layer, double points);
typedef struct vsh_scene_occluders_options {
    size_t struct_size;
    const double *receivers_min;
    const double *receivers_max;
    double
        within;
    const vsh_grid *grid;
    int32_t triangles;
    int32_t truth;
    int32_t silent_voxels;
    int32_t voxels;
    double points;
} vsh_scene_occluders_options;
 vsh_result vsh_scene_occluders(const vsh_scene *scene, const vsh_assets *assets,
                                       const vsh_scene_occluders_options *options, const vsh_run *run,
                                       vsh_occluders **occluders, vsh_error *error);
 vsh_result vsh_scene_truth(const vsh_scene *scene, const vsh_assets *assets, const vsh_run *run,
                                   vsh_triangles **triangles, vsh_solids **solids, vsh_error *error);
 int32_t vsh_scene_has_truth(const vsh_scene *scene);
 double vsh_scene_reach(const vsh_scene *scene, const vsh_grid *grid, const double receivers_min[3],
                               const double receivers_max[3]);
typedef struct vsh_job_lightmap {
    size_t receiver;
    const char *path;
    const char *output;
    const vsh_mesh *meshes;
    size_t mesh_count;
    int32_t width;
    int32_t height;
    uint64_t covered;
    uint64_t samples;
    int32_t bands;
    int32_t band_rows;
    uint64_t invalid_texels;
    uint64_t resumed_rows;
    int32_t kept_rows;
    size_t page;
} vsh_job_lightmap;
typedef struct vsh_row_sink {
    size_t struct_size;
    vsh_result (*begin)(void *user, const vsh_job_lightmap *lightmap, const vsh_image *image,
                        vsh_error *error);
    vsh_result (*add)(void *user, int32_t rows, const float *const *planes, vsh_error *error);
    vsh_result (*end)(void *user, vsh_result result, vsh_error *error);
    void *user;
} vsh_row_sink;
typedef struct vsh_bake_job_options {
    size_t struct_size;
    int32_t per_object;
    int32_t allow_overlap;
    int32_t band_rows;
    int32_t
        resume;
    const char *invalid_picture;
    const vsh_row_sink *sink;
    const char *command;
    const char *const *files;
    size_t file_count;
    void (*done)(void *user, const vsh_job_lightmap *lightmap, vsh_result result);
    void (*writing)(void *user, const char *path);
    void *user;
    int32_t lit_preview;
    int32_t lit_image_place;
    const char *lit_exr;
} vsh_bake_job_options;
typedef struct vsh_bake_job vsh_bake_job;
 vsh_result vsh_receiver_check(const vsh_scene *scene, size_t index, vsh_error *error);
 vsh_result vsh_bake_job_create(const vsh_scene *scene, const vsh_bake_job_options *options,
                                       const vsh_run *run, vsh_bake_job **job, vsh_error *error);
 void vsh_bake_job_free(vsh_bake_job *job);
 vsh_result vsh_bake_job_measure(vsh_bake_job *job, const vsh_run *run, vsh_error *error);
 vsh_result vsh_bake_job_prepare(vsh_bake_job *job, const vsh_run *run, vsh_error *error);
 vsh_result vsh_bake_job_run(vsh_bake_job *job, const vsh_run *run, vsh_error *error);
 size_t vsh_bake_job_count(const vsh_bake_job *job);
 void vsh_bake_job_lightmap_sized(const vsh_bake_job *job, size_t index, vsh_job_lightmap *lightmap,
                                         size_t lightmap_size);
 const vsh_assets *vsh_bake_job_assets(const vsh_bake_job *job);
typedef struct vsh_bake_report {
    double load_s;
    double bake_s;
    double write_s;
    uint64_t texels;
    uint64_t invalid_texels;
    uint64_t resumed_rows;
    uint64_t bands;
    vsh_shade_stats shade;
    vsh_occluders_info occluders;
    const vsh_bake_error *errors;
    size_t error_count;
} vsh_bake_report;
 void vsh_bake_job_get_report_sized(const vsh_bake_job *job, vsh_bake_report *report,
                                           size_t report_size);
 vsh_result vsh_bake_scene_sized(const vsh_scene *scene, const vsh_bake_job_options *options,
                                        const vsh_run *run, vsh_bake_report *report, size_t report_size,
                                        vsh_error *error);
typedef struct vsh_bake_forecast {
    uint64_t texels;
    uint64_t samples;
    double voxels;
    double voxel_size;
    double resolution;
    double peak_bytes;
    double grid_bytes;
    double field_bytes;
    double voxelize_s;
    double field_s;
    double bake_s;
    int32_t has_triangles;
} vsh_bake_forecast;
 vsh_result vsh_bake_job_forecast_sized(vsh_bake_job *job, const vsh_run *run,
                                               vsh_bake_forecast *forecast, size_t forecast_size,
                                               vsh_error *error);
 vsh_result vsh_receiver_charts(const vsh_scene *scene, size_t index, const vsh_mesh *meshes,
                                       size_t mesh_count, int32_t allow_overlap, const vsh_run *run,
                                       vsh_charts **charts, vsh_error *error);
typedef struct vsh_coverage {
    uint64_t golden;
    uint64_t values;
    uint64_t both;
    uint64_t differs;
    uint64_t first;
    double share;
} vsh_coverage;
 void vsh_compare_coverage_sized(uint64_t count, const float *golden, const float *values,
                                        uint8_t *mask, vsh_coverage *coverage, size_t coverage_size);
typedef struct vsh_compared {
    int32_t size[3];
    const float *golden;
    const float *values;
    const uint8_t *mask;
} vsh_compared;
typedef struct vsh_compare_options {
    size_t struct_size;
    double threshold;
    double step;
    int32_t reach;
    double noise;
} vsh_compare_options;
enum {
    VSH_MEASURE_NONFINITE =
        0,
    VSH_MEASURE_RMSE = 1,
    VSH_MEASURE_BIAS = 2,
    VSH_MEASURE_MAX = 3,
    VSH_MEASURE_P99 = 4,
    VSH_MEASURE_SHARE = 5,
    VSH_MEASURE_SSIM = 6,
    VSH_MEASURE_PENUMBRA = 7,
    VSH_MEASURE_WIDTHS = 8,
    VSH_MEASURE_EDGES = 9,
    VSH_MEASURE_SHIFT = 10,
    VSH_MEASURE_LOST = 11,
    VSH_MEASURE_GAINED = 12,
    VSH_MEASURE_COUNT = 13
};
 int32_t vsh_measure(const char *name);
 const char *vsh_measure_name(int32_t measure);
 int32_t vsh_measure_at_least(int32_t measure);
typedef struct vsh_region {
    uint64_t count;
    uint64_t worst;
    double by;
    int32_t min[3];
    int32_t max[3];
} vsh_region;
typedef struct vsh_measures {
    uint64_t count;
    double range;
    double value[VSH_MEASURE_COUNT];
    uint64_t nonfinite[2];
    uint64_t nonfinite_first[2];
    double bias;
    uint64_t worst;
    double worst_value[2];
    uint64_t edges[2];
    uint64_t pairs;
    double width[2];
    double shift[3];
    double explained;
    vsh_region lost, gained;
} vsh_measures;
 vsh_result vsh_compare_sized(const vsh_compared *compared, const vsh_compare_options *options,
                                     const vsh_run *run, vsh_measures *measures, size_t measures_size,
                                     vsh_error *error);
typedef struct vsh_accuracy {
    uint64_t count;
    uint64_t penumbra;
    double rmse;
    double penumbra_rmse;
    double bias;
    double p95, p99;
    double max;
    double width_error;
} vsh_accuracy;
 vsh_result vsh_compare_accuracy_sized(const vsh_compared *planes, size_t plane_count,
                                              const vsh_run *run, vsh_accuracy *accuracy,
                                              size_t accuracy_size, vsh_error *error);
typedef struct vsh_limits {
    size_t struct_size;
    double value[VSH_MEASURE_COUNT];
    vsh_compare_options options;
} vsh_limits;
 void vsh_limits_default_sized(vsh_limits *limits, size_t limits_size);
 void vsh_limits_allow_noise(vsh_limits *limits, double noise);
 uint32_t vsh_compare_judge(const vsh_measures *measures, const vsh_limits *limits);
typedef struct vsh_tolerances vsh_tolerances;
 vsh_result vsh_tolerances_read(const char *path, vsh_tolerances **tolerances, vsh_error *error);
 void vsh_tolerances_free(vsh_tolerances *tolerances);
 void vsh_tolerances_apply(const vsh_tolerances *tolerances, const char *channel, vsh_limits *limits,
                                  double *coverage);
typedef struct vsh_channel_comparison {
    char name[VSH_CHANNEL_NAME];
    int32_t size[3];
    int32_t origin[3];
    int32_t is_coverage;
    vsh_coverage coverage;
    double coverage_limit;
    double max_error[2];
    vsh_limits limits;
    vsh_measures measures;
    uint32_t failed;
    int32_t coverage_failed, alike;
} vsh_channel_comparison;
typedef struct vsh_compare_files_options {
    size_t struct_size;
    const char
        *tolerances;
    const char *coverage;
    double limits[VSH_MEASURE_COUNT];
    double coverage_limit;
    double threshold, step;
    double noise;
    int32_t reach;
    int32_t padding;
    int32_t (*look)(void *user, size_t index, const vsh_channel_comparison *channel,
                    const vsh_compared *compared);
    void *user;
} vsh_compare_files_options;
typedef struct vsh_comparison vsh_comparison;
 vsh_result vsh_compare_files(const char *golden, const char *fresh,
                                     const vsh_compare_files_options *options, const vsh_run *run,
                                     vsh_comparison **comparison, vsh_error *error);
 int32_t vsh_comparison_alike(const vsh_comparison *comparison);
 const vsh_channel_comparison *vsh_comparison_channel(const vsh_comparison *comparison, size_t index);
 const char *vsh_comparison_problem(const vsh_comparison *comparison, size_t index);
 void vsh_comparison_free(vsh_comparison *comparison);
enum { VSH_DIGEST_TEXT = 65 };
 vsh_result vsh_file_digest(const char *path, const vsh_run *run, char digest[VSH_DIGEST_TEXT],
                                   vsh_error *error);
enum {
    VSH_FLAT_HARD = 0,
    VSH_FLAT_CLASSIC = 1,
    VSH_FLAT_EXACT = 2
};
 int32_t vsh_flat_method(const char *name);
 const char *vsh_flat_method_name(int32_t method);
 const char *vsh_flat_light_name(int32_t type);
typedef struct vsh_flat_options {
    size_t struct_size;
    int32_t width;
    int32_t height;
    double region_min[2];
    double region_max[2];
    int32_t method;
    int32_t supersample;
    int32_t padding;
    int32_t
        max_steps;
} vsh_flat_options;
typedef struct vsh_flat_map {
    float *const *shadow;
    float *const *irradiance;
    float *coverage;
} vsh_flat_map;
 vsh_result vsh_flat_bake(const vsh_outline *casters, const vsh_light *lights, size_t light_count,
                                 const vsh_flat_options *options, const vsh_run *run, const vsh_flat_map *map,
                                 vsh_error *error);
 double vsh_flat_visibility(const vsh_outline *casters, const vsh_light *light, const double point[2]);
enum {
    VSH_FLAT_MASK = 0,
    VSH_FLAT_TEXT = 1,
    VSH_FLAT_CIRCLE = 2,
    VSH_FLAT_BOX = 3,
    VSH_FLAT_POLYGON = 4
};
typedef struct vsh_flat_caster {
    int32_t type;
    const char *path;
    vsh_mask_options mask;
    const char *text;
    vsh_text_options letters;
    double radius;
    double half_size[2];
    const double *points;
    size_t point_count;
    double transform[6];
} vsh_flat_caster;
typedef struct vsh_flat_scene {
    const vsh_flat_caster *casters;
    size_t caster_count;
    const vsh_light *lights;
    size_t light_count;
    vsh_flat_options options;
    const char *output;
    int32_t bits;
    const char *pack;
    int32_t color_space;
} vsh_flat_scene;
 vsh_result vsh_flat_scene_read(const char *path, const vsh_run *run, vsh_flat_scene **scene,
                                       vsh_error *error);
 void
vsh_flat_scene_free(vsh_flat_scene *scene);
 vsh_result vsh_flat_scene_casters(const vsh_flat_scene *scene, const vsh_run *run,
                                          vsh_outline **outline, vsh_error *error);
typedef struct vsh_provenance_source {
    size_t struct_size;
    const vsh_scene *scene;
    const char *const *files;
    size_t file_count;
    const char *command;
    double voxel_size;
    const vsh_attribute *attributes;
    size_t attribute_count;
    int32_t has_triangles;
    int32_t lightmap;
} vsh_provenance_source;
typedef struct vsh_provenance vsh_provenance;
 vsh_result vsh_provenance_create(const vsh_provenance_source *source, const vsh_run *run,
                                         vsh_provenance **provenance, vsh_error *error);
 const vsh_attribute *vsh_provenance_attributes(const vsh_provenance *provenance, size_t *count);
 double vsh_provenance_max_error(const vsh_attribute *attributes, size_t count, const char *channel);
 void vsh_provenance_free(vsh_provenance *provenance);
typedef struct vsh_query vsh_query;
 vsh_result vsh_query_create(const vsh_occluders *occluders, const vsh_light *lights,
                                    size_t light_count, const vsh_shade_options *options, vsh_query **query,
                                    vsh_error *error);
 void vsh_query_free(vsh_query *query);
typedef struct vsh_query_output {
    size_t struct_size;
    float *const *visibility;
    float *const *deviation;
    float *ao;
    float *ao_deviation;
    float *distance;
    float *gradient;
    size_t stride;
} vsh_query_output;
typedef struct vsh_point_layout {
    size_t struct_size;
    const float *float_positions;
    size_t position_stride;
    size_t normal_stride;
    size_t texel_stride;
} vsh_point_layout;
 vsh_result vsh_query_points(const vsh_query *query, const vsh_points *points,
                                    const vsh_point_layout *layout, const vsh_run *run,
                                    const vsh_query_output *output, vsh_shade_stats *stats, vsh_error *error);
enum { VSH_QUERY_BATCH = 1 << 20 };
enum { VSH_CONFINED_LIMITS = 1, VSH_CONFINED_CALLS = 2, VSH_CONFINED_FILES = 4, VSH_CONFINED_ALL = 7 };
 int32_t vsh_reader_serve(int argc, char **argv);
 vsh_result vsh_reader_confinement(const vsh_run *run, uint32_t *confined, vsh_error *error);
typedef struct vsh_camera {
    size_t struct_size;
    double position[3];
    double target[3];
    double up[3];
    double fov;
} vsh_camera;
 vsh_result vsh_camera_check(const vsh_camera *camera, vsh_error *error);
 vsh_result vsh_camera_frame(vsh_camera *camera, const double bounds_min[3],
                                    const double bounds_max[3], double azimuth, double elevation,
                                    double aspect, vsh_error *error);
 vsh_result vsh_camera_frame_points(vsh_camera *camera, size_t count, const double *points,
                                           double azimuth, double elevation, double aspect, vsh_error *error);
 void vsh_camera_orbit(vsh_camera *camera, double angle);
enum { VSH_MAX_PICTURE_SIZE = 16384, VSH_MAX_SURFACES = 65536 };
typedef struct vsh_surface {
    const vsh_field *field;
    double color[3];
} vsh_surface;
typedef struct vsh_lit_meshes {
    const vsh_mesh *meshes;
    size_t mesh_count;
    const vsh_image *lightmap;
    double color[3];
    int32_t ambient;
} vsh_lit_meshes;
typedef struct vsh_render_options {
    size_t struct_size;
    vsh_camera camera;
    int32_t width;
    int32_t height;
    int32_t samples;
    int32_t ao;
    double sky[3];
    double background[3];
    double
        shafts;
    int32_t shaft_steps;
    const vsh_lit_meshes *lit;
    size_t lit_count;
    vsh_tint tint;
    vsh_shade_options shade;
} vsh_render_options;
typedef struct vsh_picture {
    float
        *color;
    float *alpha;
    float *depth;
    float *normal;
} vsh_picture;
 vsh_result vsh_render(const vsh_surface *surfaces, size_t surface_count,
                              const vsh_occluders *occluders, const vsh_light *lights, size_t light_count,
                              const vsh_render_options *options, const vsh_run *run,
                              const vsh_picture *picture, vsh_shade_stats *stats, vsh_error *error);
 vsh_result vsh_picture_encode(const vsh_picture *picture, int32_t width, int32_t height,
                                      double exposure, float *const rgb[3], float *alpha, vsh_error *error);
enum {
    VSH_SETTINGS_OCCLUSION = 0,
    VSH_SETTINGS_CHANNELS = 1,
    VSH_SETTINGS_ACCURACY = 2,
    VSH_SETTINGS_CASTERS = 3,
    VSH_SETTINGS_IMAGE = 4,
    VSH_SETTINGS_TEXELS = 5,
    VSH_SETTINGS_FLAT_IMAGE = 6,
    VSH_SETTINGS_FLAT_TEXELS = 7
};
enum {
    VSH_SETTING_OF_SCENE = 0,
    VSH_SETTING_OF_RECEIVER = 1,
    VSH_SETTING_OF_FLAT = 2
};
typedef struct vsh_setting {
    char key[64];
    char option[64];
    char value[32];
    char help[320];
    char range[160];
    char otherwise[160];
    int32_t group;
    int32_t owner;
} vsh_setting;
 int32_t vsh_setting_get_sized(size_t index, vsh_setting *setting, size_t setting_size);
 vsh_result vsh_scene_set(vsh_scene *scene, const char *name, const char *text, vsh_error *error);
 vsh_result vsh_receiver_set(vsh_receiver *receiver, const char *name, const char *text,
                                    vsh_error *error);
 vsh_result vsh_flat_scene_set(vsh_flat_scene *scene, const char *name, const char *text,
                                      vsh_error *error);
typedef struct vsh_solidity_report {
    size_t solids;
    size_t rooms;
    size_t walls;
    size_t sheets;
    size_t closed_over;
    size_t holes;
    size_t open_edges;
    size_t turned_triangles;
    size_t standing;
} vsh_solidity_report;
 vsh_result vsh_mesh_solidity_sized(const vsh_mesh *meshes, size_t mesh_count, const vsh_run *run,
                                           vsh_solidity_report *reports, size_t reports_size,
                                           vsh_error *error);
typedef struct vsh_view_bake {
    size_t struct_size;
    const char *model;
    const char *const *planes;
    size_t plane_count;
    int32_t uv_set;
    const char
        *name;
} vsh_view_bake;
enum { VSH_MAX_VIEW_PLANES = 1024 };
 vsh_result vsh_view_write(const char *path, const vsh_view_bake *bake, const vsh_view_bake *other,
                                  const vsh_run *run, vsh_error *error);
enum { VSH_MAX_VIEW_MODEL = 384 * 1024 * 1024 - 1024 };
typedef struct vsh_voxels vsh_voxels;
 vsh_result vsh_voxels_from_grid(const vsh_grid *grid, double band, const vsh_run *run,
                                        vsh_voxels **voxels, vsh_error *error);
 vsh_result vsh_voxels_from_box(const double box_min[3], const double box_max[3], double voxel_size,
                                       const vsh_run *run, vsh_voxels **voxels, vsh_error *error);
 vsh_result vsh_voxels_from_vdb(const char *path, const char *name, const vsh_run *run,
                                       vsh_voxels **voxels, vsh_error *error);
 void vsh_voxels_free(vsh_voxels *voxels);
typedef struct vsh_voxels_info {
    uint64_t count;
    uint64_t blocks;
    int32_t index_min[3];
    int32_t index_max[3];
    double bounds_min[3];
    double bounds_max[3];
    double voxel_size[3];
    int32_t has_normals;
    uint64_t bytes;
} vsh_voxels_info;
 void vsh_voxels_get_info_sized(const vsh_voxels *voxels, vsh_voxels_info *info, size_t info_size);
 void vsh_voxels_centre(const vsh_voxels *voxels, const int32_t index[3], double centre[3]);
typedef struct vsh_volume vsh_volume;
 void vsh_volume_free(vsh_volume *volume);
typedef struct vsh_volume_info {
    size_t grids;
    uint64_t shaded;
    uint64_t filled;
    uint64_t off;
    uint64_t bytes;
} vsh_volume_info;
typedef struct vsh_volume_grid {
    char name[80];
    uint64_t active_voxels;
    uint64_t leaves;
    uint64_t tiles;
} vsh_volume_grid;
 void vsh_volume_get_info_sized(const vsh_volume *volume, vsh_volume_info *info, size_t info_size);
 void vsh_volume_get_grid_sized(const vsh_volume *volume, size_t grid, vsh_volume_grid *info,
                                       size_t info_size);
 vsh_result vsh_volume_sample(const vsh_volume *volume, size_t grid, size_t count,
                                     const double *positions, float *values, vsh_error *error);
 vsh_result vsh_volume_copy(const vsh_volume *volume, size_t grid, const int32_t index_min[3],
                                   const int32_t size[3], float *values, vsh_error *error);
 vsh_result vsh_volume_to_openvdb(const vsh_volume *volume, size_t grid, uint32_t version,
                                         uint32_t abi, void *values, vsh_error *error);
 vsh_result vsh_volume_write(const vsh_volume *volume, const char *path, int32_t half,
                                    const vsh_attribute *attributes, size_t attribute_count,
                                    vsh_error *error);
 vsh_result vsh_vdb_copy(const char *path, const char *name, const int32_t index_min[3],
                                const int32_t size[3], const vsh_run *run, float *values, float *active,
                                vsh_error *error);
enum {
    VSH_INSIDE_NEAREST = 0,
    VSH_INSIDE_OFF = 1
};
typedef struct vsh_volume_options {
    size_t struct_size;
    int32_t inside;
    int32_t ao;
    int32_t error;
    vsh_shade_options shade;
} vsh_volume_options;
 int32_t vsh_inside(const char *name);
 const char *vsh_inside_name(int32_t inside);
 vsh_result vsh_bake_volume(const vsh_occluders *occluders, const vsh_voxels *voxels,
                                   const vsh_light *lights, size_t light_count,
                                   const vsh_volume_options *options, const vsh_run *run, vsh_volume **volume,
                                   vsh_shade_stats *stats, vsh_error *error);
