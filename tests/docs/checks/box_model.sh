# The model is accepted for images of its size: with the template's textures in place of the reader's own.
object_pose --seed 2 --write-model model >/dev/null
cp block.yaml model/model.yaml
object_pose --model model --left model/left_image.png --right model/right_image.png
