/* The files that scenarios read and write, in a folder of their own. */
#include "scenarios.h"

#include <dirent.h>

static const char box_obj[] =
    "o box\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
    "vt 0 0\nvt 0.45 0\nvt 0.45 0.45\nvt 0 0.45\nvt 0.5 0.5\nvt 0.95 0.5\nvt 0.95 0.95\n"
    "f 1/1 4/2 3/3 2/4\nf 5/5 6/6 7/7\nf 5/5 7/7 8/6\nf 1 2 6 5\nf 4 8 7 3\nf 1 5 8 4\n"
    "f 2 3 7 6\n";

static const char scene_json[] =
    "{\"casters\":[{\"mesh\":\"box.obj\",\"transform\":{\"translate\":[0,0,0.1],\"rotate_deg\":[0,10,0]}},"
    "{\"mask\":\"mask.png\",\"size\":[2,2],\"thickness\":0.5},"
    "{\"heightfield\":\"mask.png\",\"size\":[4,4],\"height\":0.5,\"layer\":\"ground\"},"
    "{\"spheres\":[[2,1,0,0.5],[2,2,0,0.25]],\"layer\":\"balls\"},"
    "{\"sdf\":{\"op\":\"smooth_union\",\"smoothing\":0.2,\"of\":[{\"shape\":\"sphere\",\"radius\":0.5},"
    "{\"shape\":\"box\",\"half_size\":[0.2,0.2,0.9]}]}}],"
    "\"layers\":[{\"name\":\"ground\",\"method\":\"hard\"},{\"name\":\"balls\",\"softness\":2,\"lights\":["
    "\"sun\"]}],"
    "\"resolution\":10,\"ao\":{\"distance\":0.5},"
    "\"lights\":[{\"name\":\"sun\",\"type\":\"directional\",\"direction\":[0,1,0.2],\"angle_deg\":5}],"
    "\"receivers\":[{\"mesh\":\"box.obj\",\"size\":8,\"output\":\"out.exr\",\"pack\":\"R=ao\"}]}";

static const char flat_json[] =
    "{\"region\":[-2,-2,2,2],\"size\":8,\"casters\":[{\"mask\":\"mask.png\",\"size\":1},"
    "{\"shape\":\"box\",\"half_size\":[0.4,0.4],\"translate\":[1,1]}],"
    "\"lights\":[{\"name\":\"lamp\",\"type\":\"disc\",\"position\":[-1,1],\"radius\":0.2}],\"output\":\"o."
    "png\"}";

static const char balls_csv[] = "x,y,z,r\n0,0,0,1\n2,0,0,0.5\n# none\n0;3;0;1\n";
static const char triangle_ply[] =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
static const char triangle_stl[] =
    "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
    "endsolid a\n";

/* A quad, shown by two nodes. */
static const char quad_gltf[] =
    "{\"asset\":{\"version\":\"2.0\"},\"scenes\":[{\"nodes\":[0,1]}],\"nodes\":[{\"mesh\":0,\"name\":"
    "\"a\"},{\"mesh\":0,\"translation\":[2,0,0]}],\"meshes\":[{\"primitives\":[{\"attributes\":{\""
    "POSITION\":0},\"indices\":1,\"material\":0}]}],\"materials\":[{\"name\":\"m\"}],\"accessors\""
    ":[{\"bufferView\":0,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\",\"min\":[0,0,0],\"ma"
    "x\":[1,0,1]},{\"bufferView\":1,\"componentType\":5123,\"count\":6,\"type\":\"SCALAR\"}],\"bu"
    "fferViews\":[{\"buffer\":0,\"byteLength\":48},{\"buffer\":0,\"byteOffset\":48,\"byteLength"
    "\":12}],\"buffers\":[{\"byteLength\":60,\"uri\":\"data:application/octet-stream;base64,A"
    "AAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAIA/AAAAAAAAAAAAAIA/AAABAAIAAAACAAMA\""
    "}]}";

static const struct {
    const char *name, *text;
} inputs[] = {{"box.obj", box_obj},     {"scene.json", scene_json},     {"flat.json", flat_json},
              {"balls.csv", balls_csv}, {"triangle.ply", triangle_ply}, {"triangle.stl", triangle_stl},
              {"quad.gltf", quad_gltf}};
enum { INPUTS = sizeof inputs / sizeof inputs[0] };

static const char *const outputs[] = {"out.exr", "out.png", "out.tif", "out.vdb", "out.glb", "out.html"};
enum { OUTPUTS = sizeof outputs / sizeof outputs[0] };

static void write_text(const char *name, const char *text) {
    FILE *file = fopen(name, "wb");
    if (file == NULL || fputs(text, file) < 0 || fclose(file) != 0) {
        perror(name);
        abort();
    }
}

const char *const images[IMAGES] = {"mask.png", "mask.exr", "mask.tif"};

/* An image whose middle is 1 and whose border is 0. */
static void write_images(void) {
    float pixels[SIDE * SIDE] = {0};
    for (int i = 0; i < SIDE * SIDE; ++i) {
        const int x = i % SIDE, y = i / SIDE;
        pixels[i] = x > 2 && x < 9 && y > 2 && y < 8 && x != y ? 1.0f : 0.0f;
    }
    static const char *const name = "Y";
    const float *const plane = pixels;
    const vsh_image image = {SIDE, SIDE, 1, &name, &plane, NULL};
    for (size_t i = 0; i < IMAGES; ++i) {
        if (vsh_image_write(images[i], &image, NULL, NULL) != VSH_OK) {
            abort();
        }
    }
}

int scenarios_untouched(void) {
    int good = 1;
    for (size_t i = 0; i < OUTPUTS; ++i) {
        char text[8] = "";
        FILE *file = fopen(outputs[i], "rb");
        if (file == NULL || fread(text, 1, sizeof text - 1, file) != 3 || strcmp(text, "old") != 0) {
            good = 0;
            write_text(outputs[i], "old");
        }
        if (file != NULL) {
            fclose(file);
        }
    }
    DIR *listing = opendir(".");
    size_t files = 0;
    for (const struct dirent *entry = readdir(listing); entry != NULL; entry = readdir(listing)) {
        files += strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0;
        if (strstr(entry->d_name, ".tmp") != NULL) {
            unlink(entry->d_name);
        }
    }
    closedir(listing);
    return good && files == INPUTS + OUTPUTS + IMAGES;
}

static char folder[256];

int scenarios_begin(void **state) {
    const char *place = getenv("TMPDIR");
    snprintf(folder, sizeof folder, "%s/vdbshade-faults-XXXXXX", place != NULL ? place : "/tmp");
    if (mkdtemp(folder) == NULL || chdir(folder) != 0) {
        return -1;
    }
    for (size_t i = 0; i < INPUTS; ++i) {
        write_text(inputs[i].name, inputs[i].text);
    }
    for (size_t i = 0; i < OUTPUTS; ++i) {
        write_text(outputs[i], "old");
    }
    write_images();
    return 0;
}

int scenarios_end(void **state) {
    char command[300];
    snprintf(command, sizeof command, "rm -r '%s'", folder);
    return chdir("/") != 0 || system(command) != 0;
}
