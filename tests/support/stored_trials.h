#pragma once
// Made-up trials, and files of them.

#include <string>
#include <vector>

#include "experiments/batch/result_store.h"
#include "experiments/trial/trial_record.h"

namespace turbidock::testing {

// Has a trial end so; docked and inserted where that is a success.
inline void End(trial::TrialRecord* record, trial::Failure failure) {
  record->failure = failure;
  record->docked = record->inserted = failure == trial::Failure::kNone;
  record->outcome = record->docked                          ? trial::Outcome::kSuccess
                    : failure == trial::Failure::kCollision ? trial::Outcome::kCollision
                                                            : trial::Outcome::kTimeout;
}

// The file with these trials, to be read.
inline batch::ResultStore StoreOf(const std::string& file, const batch::StoreHeader& header,
                                  const std::vector<batch::StoredTrial>& trials) {
  {
    batch::ResultStore store = batch::ResultStore::Write(file, header);
    for (const batch::StoredTrial& trial : trials) store.Add(trial);
  }
  return batch::ResultStore::Read(file);
}

}  // namespace turbidock::testing
