"""Video files: their frames and times (`file`), pictures in the size that is read (`picture`), and the landmarks of a
whole video (`landmarks`).
"""
