"""Landmarks that another program found in pictures or videos: `reading` makes cameras of them.

The forms are OpenPose's, which Pose2Sim and Sports2D write too (`openpose`), MMPose's and AlphaPose's (`mmpose`), and
FreeMoCap's (`freemocap`). `points` says which of their points are landmarks of BlazePose, `people` whom to follow,
`film` the times and sizes of the pictures.
"""
