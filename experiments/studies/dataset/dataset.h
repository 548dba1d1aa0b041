#pragma once
// Images with ground truth, for training and testing detectors: a pair of images for each trial of
// a plan, from where that trial begins. What a plan varies and draws, these images have.
//
//   FOLDER/
//     camera.json, dataset.json              of all images, with the stereo baseline; what they
//                                            were made of
//     models/obj_000001.ply, models_info.json   the marker and its size, in mm
//     contact_sheet.png                      a few of the images with mask and keypoints drawn in
//     train_pbr/000000/                      a shard, in BOP's layout:
//       rgb/000000.png                       left camera; 000001.png the right one, and so on
//       depth/000000.png                     on request: along the optical axis, 16 bits, 0.1 mm
//       mask/000000_000000.png               the whole marker, whatever hides it
//       mask_visib/000000_000000.png         what is seen of it
//       scene_camera.json, scene_gt.json, scene_gt_info.json
//       coco_keypoints.json                  the same images as COCO keypoints, the balls' centres
//                                            (the first pixel's centre is (0.5, 0.5), in BOP's
//                                            files (0, 0)), with the visible mask as run lengths
//
// Image and pose are of one moment. `visib_fract` is the share that is seen of the whole
// silhouette, beyond the image's edge too; a keypoint that something hides has visibility 1.
//
// A shard is written whole or not at all, by a worker of its own; one that is there is not made
// again.

#include <functional>
#include <string>
#include <vector>

#include "experiments/batch/job_pool.h"
#include "experiments/batch/plan.h"

namespace turbidock::dataset {

struct DatasetOptions {
  int64_t pairs_per_shard = 250;
  bool depth = false;           // depth images, too
  batch::JobOptions jobs = {};  // with Slurm its nodes must see the folder
  std::function<void(int done, int of)> on_progress = {};  // after each shard that was missing
  std::function<bool()> stop_requested = {};               // asked every second
};

// Keys of a plan that a dataset cannot take (PlanOverrides::refused).
std::vector<batch::PlanKey> RefusedKeys();

struct DatasetSummary {
  int64_t shards = 0, shards_before = 0, images = 0;  // all there are; found; all there are
  bool complete = true;
};

// Makes a shard: the work of a task. `plugins`: those of its scenarios.
batch::Work ShardWork(const trial::Plugins& plugins);

// Makes what is missing. ConfigError for what is wrong in the plan or cannot be drawn, labelled or
// written, and for a folder whose dataset is of another plan, size of shards, depth or build.
DatasetSummary MakeDataset(const batch::Plan& plan, const std::string& folder,
                           const DatasetOptions& options);

}  // namespace turbidock::dataset
