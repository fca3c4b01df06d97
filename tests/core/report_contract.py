"""The keys that the report of a take always has: scripts rely on them."""

GROUPS = {
    "seconds": "load library search construct polish total",
    "root_error_m": "mean p95 max",
    "pelvis_error_m": "mean own",
    "skate": "contact_cm_s source_contact_cm_s stance_mm_median stances_over_21mm gmd_ratio source_gmd_ratio",
    "seam_jerk_ratio": "median p95 max share_above_real",
    "foot_correction_m": "p95",
    "speed_coverage": "above below",
    "annotation_similarity": "all keys eq18_all eq18_keys",
    "warp_rate": "min max",
    "ground_mm": "min support_max",
}
PLAIN = (
    "version seed fps frames duration_s keys ik_miss_share pelvis_drop_m pelvis_surge_ratio pose_realism loop_share "
    "warnings"
)
KEY = (
    "time_s solved_time_s labels clip clip_frame time_error_s position_error_m pelvis_error_m contact_gap_m "
    "ball_shift_m used_instead"
)


def assert_contract(report):
    assert set(PLAIN.split()) | set(GROUPS) <= set(report)
    for name, keys in GROUPS.items():
        assert set(keys.split()) <= set(report[name]), name
    for key in report["keys"]:
        assert set(KEY.split()) <= set(key)
