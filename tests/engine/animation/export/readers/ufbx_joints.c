// Prints what ufbx reads from an FBX file: ufbx_joints FILE SAMPLES_PER_SECOND [TAKE]
//   scene UNIT_METERS UP FRONT FRAMES_PER_SECOND BEGIN_S END_S BIND_POSE_BONES CUBIC_CURVES CURVES KEYS
//   take BEGIN_S END_S NAME                  per animation stack
//   joint PARENT ROTATION_ORDER NAME         per bone; PARENT counts these lines, -1 = none
//   pose x y z qw qx qy qz ...               per sample, world, in the file's units; the first is the rest pose
#include <stdio.h>
#include <stdlib.h>

#include "ufbx.h"

static int is_joint(const ufbx_node *node) { return node->bone != NULL; }

static void print_pose(const ufbx_scene *scene) {
    printf("pose");
    for (size_t i = 0; i < scene->nodes.count; i++) {
        if (!is_joint(scene->nodes.data[i])) continue;
        ufbx_transform t = ufbx_matrix_to_transform(&scene->nodes.data[i]->node_to_world);
        printf(" %.9g %.9g %.9g %.9g %.9g %.9g %.9g", t.translation.x, t.translation.y, t.translation.z,
               t.rotation.w, t.rotation.x, t.rotation.y, t.rotation.z);
    }
    printf("\n");
}

static void print_scene(const ufbx_scene *scene) {
    size_t bones = 0, cubic = 0, all_keys = 0;
    for (size_t i = 0; i < scene->poses.count; i++) {
        if (scene->poses.data[i]->is_bind_pose) bones += scene->poses.data[i]->bone_poses.count;
    }
    for (size_t i = 0; i < scene->anim_curves.count; i++) {
        ufbx_keyframe_list keys = scene->anim_curves.data[i]->keyframes;
        all_keys += keys.count;
        cubic += keys.count && keys.data[0].interpolation == UFBX_INTERPOLATION_CUBIC;
    }
    printf("scene %.9g %d %d %.9g %.15g %.15g %zu %zu %zu %zu\n", scene->settings.unit_meters, scene->settings.axes.up,
           scene->settings.axes.front, scene->settings.frames_per_second, scene->anim->time_begin,
           scene->anim->time_end, bones, cubic, scene->anim_curves.count, all_keys);
    for (size_t i = 0; i < scene->anim_stacks.count; i++) {
        const ufbx_anim_stack *stack = scene->anim_stacks.data[i];
        printf("take %.15g %.15g %s\n", stack->time_begin, stack->time_end, stack->name.data);
    }
}

static void print_joints(const ufbx_scene *scene) {
    int *line_of = calloc(scene->nodes.count, sizeof(int)), lines = 0;
    for (size_t i = 0; i < scene->nodes.count; i++) {
        const ufbx_node *node = scene->nodes.data[i];
        if (!is_joint(node)) continue;
        line_of[i] = lines++;
        int parent = node->parent && is_joint(node->parent) ? line_of[node->parent->typed_id] : -1;
        printf("joint %d %d %s\n", parent, node->rotation_order, node->name.data);
    }
    free(line_of);
}

int main(int argc, char **argv) {
    if (argc < 3) return 2;
    ufbx_error error;
    ufbx_scene *scene = ufbx_load_file(argv[1], NULL, &error);
    if (!scene) {
        fprintf(stderr, "%s\n", error.description.data);
        return 1;
    }
    print_scene(scene);
    print_joints(scene);
    print_pose(scene);
    double rate = atof(argv[2]);
    const ufbx_anim *anim = argc > 3 ? scene->anim_stacks.data[atoi(argv[3])]->anim : scene->anim;
    size_t count = (size_t)((anim->time_end - anim->time_begin) * rate + 1e-6) + 1;
    for (size_t k = 0; k < count; k++) {
        double time = anim->time_begin + (double)k / rate;
        ufbx_scene *sample = ufbx_evaluate_scene(scene, anim, time, NULL, &error);
        if (!sample) {
            fprintf(stderr, "%s\n", error.description.data);
            return 1;
        }
        print_pose(sample);
        ufbx_free_scene(sample);
    }
    ufbx_free_scene(scene);
    return 0;
}
