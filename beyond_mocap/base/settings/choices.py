"""Choices that settings of several features share: identifier, title, sentence[, icon, number]."""

PARTS = (
    ("foot", "Foot", "From ankle to toe", "MOD_DYNAMICPAINT", 0), ("head", "Head", "The middle of the head", "USER", 1),
    ("chest", "Chest", "The uppermost joint of the spine", "OUTLINER_OB_ARMATURE", 2),
    ("hand", "Hand", "The palm", "VIEW_PAN", 3),
    ("tool", "Tool", "What the hand holds, such as a racquet", "MOD_BEVEL", 4),
)
SIDES = (("right", "Right", "The right one"), ("left", "Left", "The left one"))
EITHER = (("either", "Either", "Whichever suits"), *SIDES)
BALLS = (
    ("football", "Football", "Size 5: measured drag, lift and bounce"),
    ("volleyball", "Volleyball", "Lighter, and slower in the air"), ("tennis", "Tennis Ball", "Small and fast"),
    ("paper", "As in the Paper", "Air takes 0.2 of the speed in a second, the bounce leaves 0.7, no spin"),
)
HOLDS = (
    ("KEEP", "As It Is", "The ball stays where it is beside the bone as it is taken"),
    ("TOUCH", "Touching", "The ball comes to touch the part: the palm, the foot, the brow"),
)
